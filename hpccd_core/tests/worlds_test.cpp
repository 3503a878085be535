// SPDX-License-Identifier: Apache-2.0
// Many worlds through the public C++ interface; also what the sanitizers are run on.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "equal_contacts.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 9;

// World k is in another part of the motion, and goes farther.
struct Worlds {
  explicit Worlds(std::uint32_t n) {
    for (std::uint32_t k = 0; k < n; ++k) {
      starts.push_back(test::sheet_positions(side, 0.09 * k));
      ends.push_back(test::sheet_positions(side, 0.09 * k + 0.2 * (k % 5)));
      start.insert(start.end(), starts.back().begin(), starts.back().end());
      end.insert(end.end(), ends.back().begin(), ends.back().end());
    }
  }
  std::vector<std::vector<double>> starts, ends;
  std::vector<double> start, end;  // of all
};

Options on_cpus(std::uint32_t worlds, int threads) {
  Options options;
  options.backend = Backend::cpu, options.worlds = worlds, options.threads = threads;
  return options;
}

template <class Row>
std::vector<Row> rows(const std::vector<Row>& all, const std::vector<std::uint64_t>& slices, std::size_t k) {
  return {all.begin() + static_cast<std::ptrdiff_t>(slices[k]),
          all.begin() + static_cast<std::ptrdiff_t>(slices[k + 1])};
}

void expect_world(const Contacts& all, std::size_t k, const Contacts& alone) {
  Contacts world;
  world.vf = rows(all.vf, all.slices.vf, k), world.vf_toc = rows(all.vf_toc, all.slices.vf, k);
  world.ee = rows(all.ee, all.slices.ee, k), world.ee_toc = rows(all.ee_toc, all.slices.ee, k);
  world.hash = all.slices.hashes[k];
  test::expect_equal(world, alone);
  EXPECT_EQ(all.first_tocs[k], alone.first_toc);
}

TEST(Worlds, EachAsAloneOnAnyNumberOfThreads) {
  const auto scene = test::two_sheets(side);
  for (const int threads : {1, 2, 4})
    for (const std::uint32_t n : {2u, 5u, 12u}) {
      const Worlds worlds(n);
      Detector all(scene, on_cpus(n, threads));
      for (int call = 0; call < 2; ++call) {
        const Contacts found = all.detect(test::view(worlds.start), test::view(worlds.end));
        std::uint64_t hash = 0;
        for (std::uint32_t k = 0; k < n; ++k) {
          Detector alone(scene, on_cpus(1, 1));
          const Contacts expected = alone.detect(test::view(worlds.starts[k]), test::view(worlds.ends[k]));
          expect_world(found, k, expected);
          hash += expected.hash * (2 * k + 1);
        }
        EXPECT_EQ(found.hash, hash);
        EXPECT_EQ(found.first_toc, std::ranges::min(found.first_tocs));
        EXPECT_EQ(all.stats().at("worlds"), n);
      }
    }
}

TEST(Worlds, FreeStepsOfEachAndOfAll) {
  const auto scene = test::two_sheets(side);
  const Worlds worlds(7);
  Detector all(scene, on_cpus(7, 3));
  const auto steps = all.collision_free_steps(test::view(worlds.start), test::view(worlds.end));
  ASSERT_EQ(steps.size(), 7u);
  for (std::size_t k = 0; k < 7; ++k) {
    Detector alone(scene, on_cpus(1, 1));
    EXPECT_EQ(steps[k], alone.collision_free_step(test::view(worlds.starts[k]), test::view(worlds.ends[k])));
  }
  EXPECT_EQ(all.collision_free_step(test::view(worlds.start), test::view(worlds.end)), std::ranges::min(steps));
}

TEST(Worlds, OneHasNoSlices) {
  const Worlds worlds(1);
  Detector alone(test::two_sheets(side), on_cpus(1, 2));
  const Contacts found = alone.detect(test::view(worlds.start), test::view(worlds.end));
  EXPECT_TRUE(found.slices.vf.empty() && found.slices.hashes.empty() && found.first_tocs.empty());
  EXPECT_FALSE(alone.stats().contains("worlds"));
  EXPECT_EQ(alone.collision_free_steps(test::view(worlds.start), test::view(worlds.end)).size(), 1u);
}

TEST(Worlds, SmallestDistancesOneWorldAfterTheOther) {
  const auto scene = test::two_sheets(side);
  const Worlds worlds(3);
  const std::vector<Gap> all = Detector(scene, on_cpus(3, 2)).distances(test::view(worlds.start));
  ASSERT_EQ(all.size(), 9u);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<Gap> gaps = Detector(scene, on_cpus(1, 1)).distances(test::view(worlds.starts[k]));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(all[3 * k + i].distance, gaps[i].distance);
  }
}

TEST(Worlds, HowManyAndHowLarge) {
  const auto scene = test::two_sheets(side);
  EXPECT_THROW(Detector(scene, on_cpus(0, 1)), InvalidArgument);
  EXPECT_THROW(Detector(scene, on_cpus(Options::most_worlds + 1, 1)), InvalidArgument);
  Detector all(scene, on_cpus(3, 2));
  const Worlds two(2), three(3);
  EXPECT_THROW(all.detect(test::view(two.start), test::view(two.end)), InvalidArgument);
  EXPECT_NO_THROW(all.detect(test::view(three.start), test::view(three.end)));
}

TEST(Worlds, TheFirstBadOneIsNamed) {
  Worlds worlds(12);
  Detector all(test::two_sheets(side), on_cpus(12, 4));
  const std::size_t values = worlds.starts[0].size();
  worlds.start[9 * values + 3 * 4 + 1] = std::numeric_limits<double>::infinity();
  worlds.start[5 * values + 3 * 8] = std::numeric_limits<double>::quiet_NaN();
  for (int call = 0; call < 20; ++call) try {
      all.detect(test::view(worlds.start), test::view(worlds.end));
      FAIL();
    } catch (const InvalidArgument& error) {
      EXPECT_EQ(std::string(error.what()), "vertices_t0[5, 8, 0] is NaN; all coordinates must be finite");
    }
}

TEST(Worlds, CancelledFromAnotherThread) {
  const Worlds worlds(40);
  for (const int threads : {1, 3}) {
    Detector all(test::two_sheets(side), on_cpus(40, threads));
    std::thread canceller([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      all.cancel();
    });
    EXPECT_THROW(for (;;) all.detect(test::view(worlds.start), test::view(worlds.end)), Cancelled);
    canceller.join();
  }
}

}  // namespace
}  // namespace hpccd
