// SPDX-License-Identifier: Apache-2.0
// A device of the hybrid backend that performs the real elementary tests on a thread of its own, one submission after
// the other; and what can go wrong with one.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "bvh/motion_bounds.h"
#include "hybrid/test_device.h"
#include "other_arithmetic.h"
#include "scene/features.h"
#include "traverse/worker.h"

namespace hpccd::test {

// How the device misbehaves: it throws at the n-th call of a kind, or finishes nothing until allowed to; and what it
// has seen.
struct DeviceFaults {
  std::atomic<int> submits_before_failure{-1};  // -1: never
  std::atomic<bool> fails_at_begin{false};
  std::atomic<bool> holds_back{false};
  SeenArithmetic arithmetic{};  // of the communication thread
};

// A batch test that leaves everything to the fallback.
inline void all_undecided(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t n,
                          BatchResult& result) {
  result.n_contacts = 0, result.n_undecided = n;
  std::iota(result.undecided, result.undecided + n, 0u);
  result.counts.tested += n, result.counts.undecided += n;
}

class CpuTestDevice final : public hybrid::TestDevice {
 public:
  CpuTestDevice(const Features& features, const PairRules& rules, const Tree& tree, BatchTest test, double separation,
                std::shared_ptr<DeviceFaults> faults)
      : features_(features),
        rules_(rules),
        tree_(tree),
        test_(test),
        separation_(separation),
        faults_(std::move(faults)),
        pool_(1),
        thread_([this] { work(); }) {}
  ~CpuTestDevice() override {
    {
      std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  void begin_frame(Positions t0, Positions t1) override {
    faults_->arithmetic = seen_arithmetic();
    if (faults_->fails_at_begin) throw std::runtime_error("asked for: at begin");
    motion_.update(t0, t1, pool_);
  }
  void begin_traversal(const hybrid::LeafTable&) override {}
  std::size_t slots() const override { return 4; }
  std::size_t cores() const override { return 2; }

  hybrid::Ticket submit(const std::vector<hybrid::Piece>& pieces) override {
    if (faults_->submits_before_failure >= 0 && faults_->submits_before_failure-- == 0)
      throw std::runtime_error("asked for: at a submission");
    std::lock_guard lock(mutex_);
    jobs_.push_back({++last_ticket_, pieces, false, {}});
    changed_.notify_all();
    return last_ticket_;
  }
  bool ready(hybrid::Ticket ticket) override {
    std::lock_guard lock(mutex_);
    return !faults_->holds_back && job(ticket).done;
  }
  void collect(hybrid::Ticket ticket, hybrid::Output& output) override {
    std::lock_guard lock(mutex_);
    const Job& done = job(ticket);
    append(output.vertex_face, done.output.vertex_face);
    append(output.edge_edge, done.output.edge_edge);
    append(output.undecided, done.output.undecided);
    for (int k = 0; k < 2; ++k) output.counts[k].tested += done.output.counts[k].tested;
    std::erase_if(jobs_, [&](const Job& j) { return j.ticket == ticket; });
  }
  void cancel() override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !busy_; });
    jobs_.clear();
  }
  void count(std::map<std::string, std::uint64_t>& stats) const override { stats["test_devices"] += 1; }

 private:
  template <class T>
  static void append(std::vector<T>& to, const std::vector<T>& more) {
    to.insert(to.end(), more.begin(), more.end());
  }
  struct Job {
    hybrid::Ticket ticket;
    std::vector<hybrid::Piece> pieces;
    bool done;
    hybrid::Output output;
  };
  Job& job(hybrid::Ticket ticket) {
    for (Job& j : jobs_)
      if (j.ticket == ticket) return j;
    throw std::logic_error("no such submission");
  }
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      Job* next = nullptr;
      changed_.wait(lock, [&] {
        for (Job& j : jobs_)
          if (!j.done && !next) next = &j;
        return stop_ || next;
      });
      if (stop_) return;
      const Job given{next->ticket, next->pieces, false, {}};
      busy_ = true;
      lock.unlock();
      hybrid::Output output = perform(given);
      lock.lock();
      busy_ = false;
      for (Job& j : jobs_)
        if (j.ticket == given.ticket) j.output = std::move(output), j.done = true;
      changed_.notify_all();
    }
  }
  hybrid::Output perform(const Job& job) {
    ContactSearch search(tree_, rules_, Simd::scalar);
    for (auto& test : search.batch_test) test = test_;
    search.geometry = {motion_.vertices.data(), features_.edges.data(), features_.faces.data(), nullptr};
    search.geometry.separations = {separation_};
    Worker worker;
    worker.begin(search);
    for (const hybrid::Piece& piece : job.pieces)
      for (std::size_t i = 0; i < piece.n; ++i) search.test_leaves(piece.pairs[i], worker);
    worker.flush();
    hybrid::Output output;
    output.vertex_face = worker.vertex_face;
    // Some as a device brings them that has no exact arithmetic: the CPU finds the same time for them.
    for (const Contact& f : worker.edge_edge) {
      if (test_ == all_undecided && f.first % 3 == 0)
        output.undecided.push_back({f.first, f.second, Kind::edge_edge});
      else
        output.edge_edge.push_back(f);
    }
    for (int k = 0; k < 2; ++k) output.counts[k] = worker.counts[k];
    return output;
  }

  const Features& features_;
  const PairRules& rules_;
  const Tree& tree_;
  const BatchTest test_;  // of each batch of feature pairs
  const double separation_;
  std::shared_ptr<DeviceFaults> faults_;
  ThreadPool pool_;
  MotionBounds motion_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  hybrid::Ticket last_ticket_ = 0;
  bool busy_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace hpccd::test
