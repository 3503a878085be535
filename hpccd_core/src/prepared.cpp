// SPDX-License-Identifier: Apache-2.0
#include "hpccd/prepared.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "gpu/download.h"
#include "prepared_impl.h"

namespace hpccd {
namespace {

std::string why_incomplete(std::uint64_t state) {
  std::string why;
  if (state & PreparedCounts::no_room) why += "; it needs more room than the motion it was prepared for";
  if (state & PreparedCounts::left_to_cpu) why += "; some of its pairs are for the CPU's integers";
  if (state & PreparedCounts::bad_coordinates) why += "; a coordinate is NaN, infinite or too large";
  if (state & PreparedCounts::too_many_of_one) why += "; one of its features touches more than 2,048 others";
  return why;
}

}  // namespace

PreparedDetection::PreparedDetection(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PreparedDetection::~PreparedDetection() = default;

void PreparedDetection::enqueue(void* stream) {
  const std::lock_guard lock(impl_->one_call);
  impl_->pipeline->enqueue(stream);
}

const PreparedResults& PreparedDetection::results() const { return impl_->results; }

DeviceResults PreparedDetection::contacts() const {
  const std::lock_guard lock(impl_->one_call);
  const PreparedResults& p = impl_->results;
  PreparedCounts c;
  gpu::download(p.counts, &c, sizeof c);
  if (c.state != PreparedCounts::complete)
    throw std::runtime_error("the last detection is not complete" + why_incomplete(c.state) +
                             "; detect() handles any motion; if only room is lacking, prepare() with that motion or "
                             "with more room");
  DeviceResults r;
  r.memory = p.memory, r.device = p.device;
  r.n_vf = c.vertex_face, r.n_ee = c.edge_edge;
  r.vf = p.vf, r.ee = p.ee, r.values = p.tocs;
  r.hash = c.hash, r.first_toc = c.first_toc;
  r.vf_offsets = p.vf_offsets, r.ee_offsets = p.ee_offsets, r.hashes = p.hashes, r.first_tocs = p.first_tocs;
  r.points = p.points, r.normals = p.normals, r.closest = p.closest;
  r.vertices = p.vertices, r.weights = p.weights, r.approach = p.approach;
  return r;
}

}  // namespace hpccd
