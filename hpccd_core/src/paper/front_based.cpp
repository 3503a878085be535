// SPDX-License-Identifier: Apache-2.0
// The front-based decomposition of Tang et al. 2009, "Multi-core collision detection between deformable models", with
// which Kim et al. 2009 compare in section 6.3: the front of the traversal tree is kept from step to step and
// distributed to the threads. The front refers to nodes, so the hierarchy is refitted but never restructured; when its
// quality has become too low, hierarchy and front are rebuilt.
#include "bvh/tree.h"
#include "paper/build.h"
#include "paper/front.h"
#include "paper/method.h"
#include "paper/refit.h"

namespace hpccd::paper {
namespace {

double relative_area(const Hierarchy& h) {
  if (h.nodes.empty() || !(h.nodes[0].box.half_area() > 0)) return 0;
  double sum = 0;
  for (const Node& n : h.nodes) sum += n.box.half_area();
  return sum / h.nodes[0].box.half_area();
}

class FrontBased final : public MethodEngine {
 public:
  explicit FrontBased(const Context& context)
      : context_(context), counts_(static_cast<std::size_t>(context.pool.size())) {}

  void update(const std::vector<Box>& vertex_boxes, Profiler& profiler) override {
    counts_.assign(counts_.size(), {});
    rebuilt_ = 0;
    if (whole_) {
      refit(h_, context_.features, vertex_boxes, context_.pool);
      profiler.mark("refit");
      whole_ = !worn_out({relative_area(h_)}, {area_when_built_});
    }
    if (!whole_) {
      build(h_, context_.features, vertex_boxes, context_.pool);
      context_.pool.cancellation().heed();
      ancestry_ = Ancestry(h_);
      context_.pool.cancellation().heed();
      area_when_built_ = relative_area(h_);
      front_.clear();
      rebuilt_ = 1;
      profiler.mark("build");
    }
    whole_ = false;  // until this step's front is complete
  }

  void traverse(const std::vector<Box>& vertex_boxes, Search& search, std::vector<Worker>& workers) override {
    const Scenery scenery{h_, context_.features, context_.rules, vertex_boxes};
    for (Worker& w : workers) w.begin(search);
    if (rebuilt_) start_front(scenery, workers[0]);
    deal_out(scenery, workers);
    whole_ = true;
  }

  void count(std::map<std::string, std::uint64_t>& stats) const override {
    for (const FrontCounts& c : counts_) {
      stats["front_descended"] += c.descended;
      stats["front_ascended"] += c.ascended;
    }
    std::uint64_t pairs = 0;
    for (const FrontSegment& s : front_) pairs += s.size();
    stats["front_pairs"] = pairs;
    stats["front_rebuilt"] = rebuilt_;
  }

  std::size_t bytes() const override {
    std::size_t b = h_.bytes() + ancestry_.bytes();
    for (const FrontSegment& s : front_) b += sizeof(s) + s.capacity() * sizeof(Pair);
    return b;
  }

 private:
  // The pair of the root with itself, refined level by level until there are enough pairs to distribute.
  void start_front(const Scenery& scenery, Worker& worker) {
    if (h_.nodes.empty()) return;
    const std::size_t enough = 256 * static_cast<std::size_t>(context_.pool.size());
    FrontSegment level{{0, 0}}, next;
    for (bool progress = true; progress && level.size() < enough;) {
      progress = false;
      next.clear();
      for (const Pair p : level) {
        if (!enabled(scenery, p)) continue;
        if (overlaps(scenery, p) && !is_leaf_pair(scenery, p)) {
          ++worker.node_pairs;
          progress = true;
          refine(h_, p, [](NodeIndex) {}, [&](Pair q) { next.push_back(q); });
        } else if (p.a != p.b) {
          next.push_back(p);
        }
      }
      level.swap(next);
    }
    for (const Pair p : level) front_.push_back({p});
  }

  void deal_out(const Scenery& scenery, std::vector<Worker>& workers) {
    std::vector<std::vector<FrontSegment>> pieces(front_.size());
    std::atomic<std::size_t> next{0};
    context_.pool.run([&](int thread) {
      FrontUpdate update(scenery, ancestry_, workers[thread], counts_[thread]);
      for (;;) {
        const std::size_t i = next.fetch_add(1, std::memory_order_relaxed);
        if (i >= front_.size()) break;
        pieces[i] = update(front_[i]);
        FrontSegment().swap(front_[i]);
      }
      workers[thread].flush();
    });
    front_ = joined(std::move(pieces));
  }

  const Context context_;
  Hierarchy h_;
  Ancestry ancestry_;
  std::vector<FrontSegment> front_;
  std::vector<FrontCounts> counts_;
  double area_when_built_ = 0;
  std::uint64_t rebuilt_ = 0;
  bool whole_ = false;
};

}  // namespace

std::unique_ptr<MethodEngine> front_based(const Context& context) { return std::make_unique<FrontBased>(context); }

}  // namespace hpccd::paper
