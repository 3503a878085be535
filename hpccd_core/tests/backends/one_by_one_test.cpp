// SPDX-License-Identifier: Apache-2.0
// Many worlds by a backend of one: a device that succeeds, fails, or rejects the input.
#include "backends/one_by_one.h"

#include <gtest/gtest.h>

#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t n_worlds = 4;

// A device that finds in each world as many contacts as the x of its first vertex says.
class Device final : public DetectionBackend {
 public:
  std::size_t fails_at = n_worlds, refuses_at = n_worlds, on_cpu_at = n_worlds;
  std::size_t asked = 0;
  bool breaks_down = false;  // and leaves it to the CPU beside it

  std::optional<Detection> detect(Positions t0, Positions) override {
    const std::size_t call = asked++;
    if (breaks_down) failures_.failed("for a test");
    if (call == fails_at) return std::nullopt;
    if (call == refuses_at) throw InvalidArgument("vertices_t1[5]: moves");
    const double x = static_cast<const double*>(t0.data)[0];
    Contacts found;
    for (std::uint32_t i = 0; i < x; ++i) found.vf.push_back({i, call_number(call)}), found.vf_toc.push_back(0.5 / x);
    found.hash = 100 + call;
    found.first_toc = x > 0 ? 0.5 / x : std::numeric_limits<double>::infinity();
    return Detection{std::move(found), call == on_cpu_at ? Backend::cpu : Backend::gpu};
  }
  void count(std::map<std::string, std::uint64_t>& stats) const override { stats["pairs"] = 10, stats["bytes"] = 7; }
  void add_stages(std::map<std::string, double>& stages) const override { stages["gpu/boxes"] = 0.5; }

 private:
  static std::uint32_t call_number(std::size_t call) { return static_cast<std::uint32_t>(call); }
};

struct ManyOnDevice {
  ManyOnDevice() : common(test::two_sheets(3), of_worlds(), 1), shared(common, common.pool) {
    for (std::uint32_t k = 0; k < n_worlds; ++k) {
      std::vector<double> world = test::sheet_positions(3, 0);
      world[0] = k % 3;
      positions.insert(positions.end(), world.begin(), world.end());
    }
  }
  static Options of_worlds() {
    Options options;
    options.worlds = n_worlds;
    return options;
  }
  std::optional<Detection> detect() { return many.detect(test::view(positions), test::view(positions)); }

  Common common;
  Resources shared;
  Device device;
  CpuBackend cpu{shared};
  WorldMemories memories{n_worlds};
  OneByOne many{shared, device, cpu, memories};
  std::vector<double> positions;
};

TEST(OneByOne, RowsOfEachWorldStandTogether) {
  ManyOnDevice m;
  const auto found = m.detect();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->computed_by, Backend::gpu);
  const Contacts& c = found->contacts;
  EXPECT_EQ(c.slices.vf, (std::vector<std::uint64_t>{0, 0, 1, 3, 3}));
  EXPECT_EQ(c.slices.ee, (std::vector<std::uint64_t>{0, 0, 0, 0, 0}));
  EXPECT_EQ(c.vf, (std::vector<std::array<std::uint32_t, 2>>{{0, 1}, {0, 2}, {1, 2}}));
  EXPECT_EQ(c.hash, 100u + 3 * 101 + 5 * 102 + 7 * 103);
  EXPECT_EQ(c.first_toc, 0.25);
  EXPECT_EQ(c.first_tocs[1], 0.5);
  std::map<std::string, std::uint64_t> stats;
  m.many.count(stats);
  EXPECT_EQ(stats["pairs"], 10 * n_worlds);
  std::map<std::string, double> stages;
  m.many.add_stages(stages);
  EXPECT_EQ(stages["gpu/boxes"], 0.5 * n_worlds);
}

TEST(OneByOne, AFailureLeavesAllWorldsToTheCpu) {
  ManyOnDevice m;
  m.device.fails_at = 2;
  EXPECT_FALSE(m.detect());
  EXPECT_EQ(m.device.asked, 3u);
}

TEST(OneByOne, AfterThreeFailuresInARowTheDeviceIsLeftAlone) {
  ManyOnDevice m;
  m.device.breaks_down = true;
  EXPECT_FALSE(m.detect());
  EXPECT_EQ(m.device.asked, 3u);
}

TEST(OneByOne, WhatTheCpuDidOfOneWorldIsSaidOfAll) {
  ManyOnDevice m;
  m.device.on_cpu_at = 1;
  EXPECT_EQ(m.detect()->computed_by, Backend::cpu);
}

TEST(OneByOne, ARefusalNamesTheWorld) {
  ManyOnDevice m;
  m.device.refuses_at = 1;
  try {
    m.detect();
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(std::string(error.what()), "vertices_t1[1, 5]: moves");
  }
}

TEST(OneByOne, AQueryThatIsNotOfferedIsLeftToTheCpu) {
  ManyOnDevice m;
  EXPECT_FALSE(m.many.distances(test::view(m.positions)));
  EXPECT_FALSE(m.many.earliest(test::view(m.positions), test::view(m.positions)));
  EXPECT_FALSE(m.many.proximity(test::view(m.positions), 0.1));
  EXPECT_FALSE(m.many.intersections(test::view(m.positions)));
}

}  // namespace
}  // namespace hpccd
