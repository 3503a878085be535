// SPDX-License-Identifier: Apache-2.0
#include "gpu/frames.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "contacts/geometry.h"
#include "contacts/hash.h"
#include "elementary/fallback.h"
#include "traverse/worker.h"

namespace hpccd::gpu {
namespace {

Vec3<double> position(Positions p, std::uint32_t v) {
  const std::size_t i = 3 * std::size_t{v};
  if (p.is_double) {
    const auto* x = static_cast<const double*>(p.data) + i;
    return {x[0], x[1], x[2]};
  }
  const auto* x = static_cast<const float*>(p.data) + i;
  return {x[0], x[1], x[2]};
}

// `from` with `more` (one each at the places in `at`, ascending) put in between, by whole runs.
template <class T, class Get>
std::vector<T> spliced(const T* from, std::size_t n, const std::vector<std::size_t>& at, Get&& get) {
  std::vector<T> all;
  all.reserve(n + at.size());
  std::size_t done = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    all.insert(all.end(), from + done, from + at[k]);
    done = at[k];
    all.push_back(get(k));
  }
  all.insert(all.end(), from + done, from + n);
  return all;
}

std::uint64_t hash_of_contacts(const Contacts& c) {
  std::uint64_t h = 0;
  for (std::size_t i = 0; i < c.vf.size(); ++i) h += hash_of(Kind::vertex_face, c.vf[i][0], c.vf[i][1], c.vf_toc[i]);
  for (std::size_t i = 0; i < c.ee.size(); ++i)
    h += hash_of(Kind::edge_edge, pack(c.ee[i][0], c.ee[i][1]), pack(c.ee[i][2], c.ee[i][3]), c.ee_toc[i]);
  return h;
}

template <class Row>
void keep_until(std::vector<Row>& rows, std::vector<double>& toc, double last, std::size_t most) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < rows.size() && n < most; ++i)
    if (toc[i] <= last) rows[n] = rows[i], toc[n++] = toc[i];
  rows.resize(n);
  toc.resize(n);
}

// The device finds all contacts; what was not asked for is dropped here.
void reduce(Contacts& c, Report report) {
  if (report == Report::all) return;
  const double last = report == Report::first ? c.first_toc + simultaneous : std::numeric_limits<double>::infinity();
  const std::size_t most = report == Report::any ? 1 : SIZE_MAX;
  keep_until(c.vf, c.vf_toc, last, most);
  keep_until(c.ee, c.ee_toc, last, report == Report::any ? most - c.vf.size() : most);
  if (report == Report::any) {
    c.first_toc = std::numeric_limits<double>::infinity();
    for (const auto* tocs : {&c.vf_toc, &c.ee_toc})
      for (double t : *tocs) c.first_toc = std::min(c.first_toc, t);
  }
  c.hash = hash_of_contacts(c);
}

}  // namespace

std::string unsupported(const Options& options) {
  if (options.minimum_separation > 0) return "minimum_separation: not on the GPU; use backend=\"cpu\"";
  if (options.method != Method::standard)
    return "method: the published methods run on CPUs; use backend=\"cpu\", or method=\"default\"";
  return "";
}

Frames::Frames(const Scene& scene, const Features& features, const Options& options, ThreadPool& pool)
    : scene_(scene), features_(features), options_(options), pool_(pool) {}

std::optional<Contacts> Frames::detect(Positions t0, Positions t1, const Build& build, Profiler& profiler) {
  try {
    if (gave_up()) throw Error(last_error_);
    Contacts c = frame(t0, t1, build, profiler);
    failures_in_a_row_ = 0;
    return c;
  } catch (const Error& e) {
    ++fallbacks_;
    ++failures_in_a_row_;
    last_error_ = e.what();
    has_tree_ = false;  // nothing on the device is relied on after a failure
    return std::nullopt;
  }
}

Contacts Frames::frame(Positions t0, Positions t1, const Build& build, Profiler& profiler) {
  if (!pipeline_) {
    const char* stages = std::getenv("HPCCD_GPU_STAGES");
    pipeline_ =
        Pipeline::create(scene_, features_, options_.accuracy, status().devices.at(0).number, stages && *stages);
    profiler.mark("gpu_start");
  }
  if (area_when_built_ == 0) area_when_built_ = pipeline_->relative_area();  // as the device measures it
  if (!has_tree_ || worn_out(pipeline_->relative_area(), area_when_built_)) {
    const Tree& tree = build(on_host(t0, 0), on_host(t1, 1));
    pipeline_->set_tree(tree);
    area_when_built_ = 0;  // known when the device has refitted it
    has_tree_ = true;
    profiler.mark("build");
  }
  if (!pipeline_->run(t0, t1, pool_)) {
    MotionBounds().update(on_host(t0, 0), on_host(t1, 1), 0, pool_);
    throw Error("the device found bad coordinates where the host finds none");
  }
  profiler.mark("gpu");
  const std::vector<Candidate>& undecided = pipeline_->undecided();
  Positions h0 = t0, h1 = t1;
  if (!undecided.empty() || options_.points || options_.normals) h0 = on_host(t0, 0), h1 = on_host(t1, 1);
  exact_[0].clear(), exact_[1].clear();
  std::vector<std::optional<double>> toc(undecided.size());
  constexpr std::size_t pairs_a_piece = 8;  // about 10 us, as long as it takes to wake a thread
  parallel_for(pool_, undecided.size(), pairs_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const Candidate& u = undecided[i];
      std::uint32_t v[4];
      pair_vertices({nullptr, features_.edges.data(), features_.faces.data()}, u.kind, u.first, u.second, v);
      Vec3<double> q0[4], q1[4];
      for (int k = 0; k < 4; ++k) q0[k] = position(h0, v[k]), q1[k] = position(h1, v[k]);
      FallbackCounts counts;
      toc[i] = decide_undecided(Accuracy::exact, {}, u.kind, q0, q1, counts);
    }
  });
  for (std::size_t i = 0; i < undecided.size(); ++i)
    if (toc[i])
      exact_[undecided[i].kind == Kind::edge_edge].push_back({undecided[i].first, undecided[i].second, *toc[i]});
  for (auto& list : exact_) std::sort(list.begin(), list.end(), before);
  profiler.mark("exact");
  const FrameResult device = pipeline_->finish();
  profiler.mark("gpu_sort");
  Contacts c = join(device, h0, h1);
  profiler.mark("contacts");
  return c;
}

Contacts Frames::join(const FrameResult& d, Positions t0, Positions t1) {
  Contacts c;
  std::vector<std::size_t> at_vf, at_ee;
  for (const Contact& e : exact_[0]) {
    const std::array<std::uint32_t, 2> row{e.first, e.second};
    at_vf.push_back(static_cast<std::size_t>(std::lower_bound(d.vf, d.vf + d.n_vf, row) - d.vf));
  }
  const auto quad = [&](const Contact& e) -> std::array<std::uint32_t, 4> {
    const auto &a = features_.edges[e.first], &b = features_.edges[e.second];
    return {a[0], a[1], b[0], b[1]};
  };
  for (const Contact& e : exact_[1])
    at_ee.push_back(static_cast<std::size_t>(std::lower_bound(d.ee, d.ee + d.n_ee, quad(e)) - d.ee));
  double first[2] = {c.first_toc, c.first_toc};
  const auto toc_of = [&](int k) { return [this, k](std::size_t i) { return exact_[k][i].toc; }; };
  const auto earliest = [](const std::vector<double>& t) {
    double x = std::numeric_limits<double>::infinity();
    for (double y : t) x = y < x ? y : x;
    return x;
  };
  const std::function<void()> parts[4] = {
      [&] { c.ee = spliced(d.ee, d.n_ee, at_ee, [&](std::size_t i) { return quad(exact_[1][i]); }); },
      [&] {
        c.ee_toc = spliced(d.toc + d.n_vf, d.n_ee, at_ee, toc_of(1));
        first[1] = earliest(c.ee_toc);
      },
      [&] {
        c.vf = spliced(d.vf, d.n_vf, at_vf, [&](std::size_t i) {
          return std::array<std::uint32_t, 2>{exact_[0][i].first, exact_[0][i].second};
        });
      },
      [&] {
        c.vf_toc = spliced(d.toc, d.n_vf, at_vf, toc_of(0));
        first[0] = earliest(c.vf_toc);
      }};
  const auto copy = [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) parts[i]();
  };
  // Waking the threads costs about as much as copying 10,000 contacts.
  if (d.n_vf + d.n_ee > 10000)
    parallel_for(pool_, 4, 1, copy);
  else
    copy(0, 4, 0);
  c.first_toc = std::min(first[0], first[1]);
  c.hash = d.hash;
  for (const Contact& e : exact_[0]) c.hash += hash_of(Kind::vertex_face, e.first, e.second, e.toc);
  for (const Contact& e : exact_[1]) {
    const auto q = quad(e);
    c.hash += hash_of(Kind::edge_edge, pack(q[0], q[1]), pack(q[2], q[3]), e.toc);
  }
  reduce(c, options_.report);
  if (options_.points || options_.normals) add_outputs(c, t0, t1);
  return c;
}

void Frames::add_outputs(Contacts& c, Positions t0, Positions t1) {
  motion_.update(t0, t1, 0, pool_);
  const Geometry geometry{motion_.vertices.data(), features_.edges.data(), features_.faces.data(), nullptr,
                          motion_.map.scale};
  const auto& edges = features_.edges;
  const auto edge_number = [&](std::uint32_t v0, std::uint32_t v1) {
    const std::array<std::uint32_t, 2> e{v0, v1};
    return static_cast<std::uint32_t>(std::lower_bound(edges.begin(), edges.end(), e) - edges.begin());
  };
  const std::size_t n = c.vf.size(), m = c.ee.size();
  if (options_.points) c.points.resize(n + m);
  if (options_.normals) c.normals.resize(n + m);
  parallel_for(pool_, n + m, 1024, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool vf = i < n;
      const std::uint32_t first = vf ? c.vf[i][0] : edge_number(c.ee[i - n][0], c.ee[i - n][1]);
      const std::uint32_t second = vf ? c.vf[i][1] : edge_number(c.ee[i - n][2], c.ee[i - n][3]);
      const ContactPoint p = contact_point(geometry, vf ? Kind::vertex_face : Kind::edge_edge, first, second,
                                           vf ? c.vf_toc[i] : c.ee_toc[i - n], true);
      if (options_.points) c.points[i] = {p.point[0], p.point[1], p.point[2]};
      if (options_.normals) c.normals[i] = {p.normal[0], p.normal[1], p.normal[2]};
    }
  });
}

Positions Frames::on_host(Positions p, int which) {
  if (!p.on_device) return p;
  if (!pipeline_) throw Error("positions on the device, but no device is in use");
  return pipeline_->download(p, which);
}

std::map<std::string, std::uint64_t> Frames::stats() const {
  auto s = pipeline_ ? pipeline_->stats() : std::map<std::string, std::uint64_t>{};
  s["gpu_exact_on_cpu"] = pipeline_ ? pipeline_->undecided().size() : 0;
  s["gpu_fallbacks"] = fallbacks_;
  return s;
}

std::map<std::string, double> Frames::stages() const {
  return pipeline_ ? pipeline_->stages() : std::map<std::string, double>{};
}

}  // namespace hpccd::gpu
