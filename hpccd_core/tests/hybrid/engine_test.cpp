// SPDX-License-Identifier: Apache-2.0
// The whole of section 5 on a device that computes on a CPU thread: contacts equal the plain traversal's whatever the
// number of threads and devices, the size of the queue, lagging or failing devices. Also run under ThreadSanitizer.
#include "hybrid/engine.h"

#include <gtest/gtest.h>

#include "contacts/canonical.h"
#include "equal_contacts.h"
#include "grid_scene.h"
#include "hybrid/cpu_test_device.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 24;

// A detector with its parts laid open.
struct Bench {
  explicit Bench(int threads, BatchTest batch_test = hpccd::batch_test(Simd::scalar, Accuracy::exact),
                 double of_all_pairs = 0)
      : scene(test::two_sheets(side)),
        features(features_of(*scene)),
        separations(*scene, of_all_pairs),
        rules(*scene, Accuracy::exact, separations),
        pool(threads),
        workers(static_cast<std::size_t>(threads)) {
    for (auto& test : search.batch_test) test = batch_test;
  }

  void update(double from, double to) {
    start = test::sheet_positions(side, from), end = test::sheet_positions(side, to);
    motion.update(*scene, test::view(start), test::view(end), Growth{separations.largest()}, pool);
    build(tree, *scene, features, motion, pool);
    search.geometry = {motion.vertices.data(), features.edges.data(), features.faces.data(), nullptr};
    search.geometry.separations = {separations.first()};
  }

  Contacts collect() {
    Contacts contacts;
    collect_contacts(workers, search.geometry, Report::all, {false, false, false, false, AtTime::contact}, order, pool,
                     contacts);
    return contacts;
  }

  Contacts on_cpu() {
    search.traverse(pool, workers);
    return collect();
  }

  struct Result {
    Contacts contacts;
    bool complete;
    std::map<std::string, std::uint64_t> stats;
  };

  Result with(hybrid::Engine& engine, std::uint64_t version = 1) {
    engine.begin_frame(test::view(start), test::view(end));
    hybrid::FrameGuard frame(engine, workers);
    engine.begin_traversal({&tree.leaves, &tree.face_of_slot, &tree.edge_of_slot, &tree.vertex_of_slot, version},
                           workers);
    search.traverse(pool, workers);
    Profiler profiler;
    profiler.begin();
    Result r;
    const hybrid::Finished finished = frame.finish(profiler);
    r.complete = finished.complete;
    for (const LeafPair pair : finished.untested) search.test_leaves(pair, workers[0]);
    workers[0].flush();
    engine.count(r.stats);
    r.contacts = collect();
    return r;
  }

  // Frames with the contacts expected, until one counts something of this name: on a busy machine a small scene may be
  // traversed before the communication thread has woken up, or all pairs given back to the threads.
  void expect_in_some_frame(const char* count, hybrid::Engine& engine, const Contacts& expected) {
    std::uint64_t counted = 0;
    for (int frame = 0; frame < 2000 && counted == 0; ++frame) {
      const Result result = with(engine);
      counted = result.stats.at(count);
      test::expect_equal(result.contacts, expected);
    }
    EXPECT_GT(counted, 0u) << count;
  }

  hybrid::Communication::Devices devices(std::size_t n) {
    hybrid::Communication::Devices list;
    for (std::size_t i = 0; i < n; ++i)
      list.push_back(std::make_unique<test::CpuTestDevice>(features, rules, tree, search.batch_test[0],
                                                           separations.first(), faults));
    return list;
  }

  std::shared_ptr<const Scene> scene;
  Features features;
  SeparationTable separations;
  PairRules rules;
  ThreadPool pool;
  std::vector<Worker> workers;
  MotionBounds motion;
  Tree tree;
  ContactSearch search{tree, rules, Simd::scalar};
  ContactOrder order;
  std::vector<double> start, end;
  std::shared_ptr<test::DeviceFaults> faults = std::make_shared<test::DeviceFaults>();
};

TEST(Hybrid, SameContactsForAnyThreadsDevicesAndSegments) {
  for (const int threads : {1, 2, 4}) {
    Bench bench(threads);
    bench.update(0, 1);
    const Contacts expected = bench.on_cpu();
    ASSERT_GT(expected.vf.size() + expected.ee.size(), 200u);
    for (const std::size_t n_devices : {1u, 2u})
      for (const hybrid::Sizes sizes : {hybrid::Sizes{}, hybrid::Sizes{8, 16}, hybrid::Sizes{1, 1}}) {
        hybrid::Engine engine(bench.devices(n_devices), sizes, bench.pool);
        const auto result = bench.with(engine);
        EXPECT_TRUE(result.complete);
        EXPECT_EQ(result.stats.at("test_devices"), n_devices);
        test::expect_equal(result.contacts, expected);
      }
  }
}

TEST(Hybrid, TheCommunicationThreadHasTheStandardArithmetic) {
  Bench bench(1);
  bench.update(0, 1);
  for (const int mode : test::other_modes) {
    const test::OtherArithmetic other(mode);
    hybrid::Engine engine(bench.devices(1), {8, 16}, bench.pool);
    EXPECT_TRUE(bench.with(engine).complete);
    EXPECT_EQ(bench.faults->arithmetic, test::standard_arithmetic);
  }
}

TEST(Hybrid, SegmentsGoToTheDevices) {
  Bench bench(2);
  bench.update(0, 1);
  const Contacts expected = bench.on_cpu();
  hybrid::Engine engine(bench.devices(2), {8, 16}, bench.pool);
  bench.expect_in_some_frame("hybrid_calls", engine, expected);
}

TEST(Hybrid, FrameAfterFrameAndOnANewTree) {
  Bench bench(3);
  bench.update(0, 0.5);
  hybrid::Engine engine(bench.devices(2), {16, 32}, bench.pool);
  for (int k = 0; k < 30; ++k) {
    bench.update(0.03 * k, 0.03 * k + 0.5);
    const auto result = bench.with(engine, static_cast<std::uint64_t>(k + 1));
    EXPECT_TRUE(result.complete);
    test::expect_equal(result.contacts, bench.on_cpu());
  }
}

TEST(Hybrid, WhatADeviceLeavesUndecidedIsDecidedOnTheCpu) {
  Bench bench(2, test::all_undecided);
  bench.update(0, 1);
  const Contacts expected = bench.on_cpu();
  hybrid::Engine engine(bench.devices(1), {8, 16}, bench.pool);
  bench.expect_in_some_frame("gpu_exact_on_cpu", engine, expected);
}

TEST(Hybrid, WhatADeviceLeavesUndecidedIsDecidedByItsSeparation) {
  Bench bench(2, test::all_undecided, 0.05), without(2);
  bench.update(0, 1), without.update(0, 1);
  const Contacts expected = bench.on_cpu();
  ASSERT_NE(expected.hash, without.on_cpu().hash);
  hybrid::Engine engine(bench.devices(1), {8, 16}, bench.pool);
  bench.expect_in_some_frame("gpu_exact_on_cpu", engine, expected);
}

TEST(Hybrid, ThreadsTestHalfSegmentsThemselvesWhereDevicesLag) {
  Bench bench(2);
  bench.update(0, 1);
  const Contacts expected = bench.on_cpu();
  hybrid::Engine engine(bench.devices(1), {8, 16}, bench.pool);
  std::uint64_t on_cpu = 0;
  // A busy machine may hold the threads back for longer than the device is.
  for (int frame = 0; frame < 100 && on_cpu == 0; ++frame) {
    bench.faults->holds_back = true;
    std::thread release([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      bench.faults->holds_back = false;
    });
    const auto result = bench.with(engine);
    release.join();
    EXPECT_TRUE(result.complete);
    on_cpu = result.stats.at("hybrid_pairs_on_cpu");
    test::expect_equal(result.contacts, expected);
  }
  EXPECT_GT(on_cpu, 0u);
}

TEST(Hybrid, AFrameInWhichADeviceFailsIsFinishedOnTheCpu) {
  Bench bench(2);
  bench.update(0, 1);
  const Contacts expected = bench.on_cpu();
  hybrid::Engine engine(bench.devices(2), {16, 16}, bench.pool);
  for (const int good_submissions : {0, 1, 2, 5}) {
    bench.faults->submits_before_failure = good_submissions;
    auto failed = bench.with(engine);
    // How many runs of segments a frame is sent in depends on how the threads are scheduled.
    for (int frame = 0; frame < 1000 && failed.complete; ++frame) {
      test::expect_equal(failed.contacts, expected);
      failed = bench.with(engine);
    }
    EXPECT_FALSE(failed.complete);
    EXPECT_EQ(engine.error(), "asked for: at a submission");
    test::expect_equal(failed.contacts, expected);
    bench.faults->submits_before_failure = -1;
    const auto next = bench.with(engine);
    EXPECT_TRUE(next.complete);
    test::expect_equal(next.contacts, expected);
  }
  bench.faults->fails_at_begin = true;
  const auto failed = bench.with(engine);
  EXPECT_FALSE(failed.complete);
  EXPECT_EQ(engine.error(), "asked for: at begin");
  test::expect_equal(failed.contacts, expected);
}

TEST(Hybrid, AFrameThatIsGivenUpLeavesNothingBehind) {
  Bench bench(2);
  bench.update(0, 1);
  const Contacts expected = bench.on_cpu();
  hybrid::Engine engine(bench.devices(1), {8, 16}, bench.pool);
  for (int k = 0; k < 3; ++k) {
    engine.begin_frame(test::view(bench.start), test::view(bench.end));
    hybrid::FrameGuard(engine, bench.workers);  // as when the positions turn out to be bad
    const auto result = bench.with(engine);
    EXPECT_TRUE(result.complete);
    test::expect_equal(result.contacts, expected);
  }
}

}  // namespace
}  // namespace hpccd
