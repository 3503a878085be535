// SPDX-License-Identifier: Apache-2.0
// Places of a pair on devices equal those on CPUs, unless devices leave them undecided; they leave few undecided.
#include "contacts/pair_places.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "contacts/places.h"
#include "elementary/exact/contact.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

struct Asked {
  PairPlaces places;
  bool open;
};

Asked as_on_devices(const UndecidedPair& q, double toc, Outputs outputs) {
  LeftOpen arbiter;
  const PairPlaces places = q.kind == Kind::vertex_face
                                ? pair_places<Kind::vertex_face>(q.t0, q.t1, toc, q.separation, outputs, arbiter)
                                : pair_places<Kind::edge_edge>(q.t0, q.t1, toc, q.separation, outputs, arbiter);
  return {places, arbiter.open};
}

constexpr double step = 0.5;

UndecidedPair random_pair(Kind kind, double separation, std::mt19937_64& random) {
  std::uniform_real_distribution<double> real(-1, 1);
  UndecidedPair q{kind, {}, {}, separation};
  for (int k = 0; k < 4; ++k) {
    q.t0[k] = {real(random), real(random), real(random)};
    q.t1[k] = q.t0[k] + step * V{real(random), real(random), real(random)};
  }
  return q;
}

UndecidedPair degenerate_pair(Kind kind, double separation, std::mt19937_64& random) {
  UndecidedPair q{kind, {}, {}, separation};
  for (auto* ends : {q.t0, q.t1})
    for (int k = 0; k < 4; ++k)
      for (double* x : {&ends[k].x, &ends[k].y, &ends[k].z}) *x = static_cast<int>(random() % 3) - 1;
  return q;
}

class PlacesOf : public ::testing::TestWithParam<std::tuple<Kind, double>> {};

TEST_P(PlacesOf, WhatDevicesDoNotLeaveOpenIsWhatCpusSay) {
  const auto [kind, separation] = GetParam();
  std::mt19937_64 random(11);
  int open = 0, closed = 0;
  for (int i = 0; i < 20000; ++i) {
    const UndecidedPair q = i % 2 ? random_pair(kind, separation, random) : degenerate_pair(kind, separation, random);
    const double toc = exact::earliest_contact(kind, q.t0, q.t1).value_or(0.375);
    for (int asked = 0; asked < 16; ++asked)
      for (const AtTime at : {AtTime::contact, AtTime::start}) {
        const Outputs outputs{(asked & 1) != 0, (asked & 2) != 0, (asked & 4) != 0, (asked & 8) != 0, at};
        const Asked device = as_on_devices(q, toc, outputs);
        ++(device.open ? open : closed);
        if (asked == 1 && separation == 0)
          EXPECT_FALSE(device.open) << "points of plain contact need no integers, whatever the features";
        if (device.open) continue;
        const PairPlaces cpu = pair_places(q, toc, outputs);
        ASSERT_EQ(std::memcmp(&device.places, &cpu, sizeof cpu), 0) << "query " << i << ", asked " << asked;
      }
  }
  EXPECT_GT(open, 1000) << "degenerate features are for integers";
  EXPECT_GT(closed, 1000);
}

TEST_P(PlacesOf, LittleIsOpenOfFeaturesInGeneralPosition) {
  const auto [kind, separation] = GetParam();
  std::mt19937_64 random(12);
  int contacts = 0, open = 0;
  for (int i = 0; i < 100000; ++i) {
    const UndecidedPair q = random_pair(kind, separation, random);
    const auto toc = exact::earliest_contact(kind, q.t0, q.t1);
    if (!toc) continue;
    // With a separation: apart, which the time of contact is not.
    const double time = separation > 0 ? 0.5 * *toc : *toc;
    ++contacts;
    open += as_on_devices(q, time, {true, true, separation > 0, true, AtTime::contact}).open;
  }
  EXPECT_GT(contacts, 1000);
  EXPECT_LT(open, 0.02 * contacts);
}

INSTANTIATE_TEST_SUITE_P(All, PlacesOf,
                         ::testing::Combine(::testing::Values(Kind::vertex_face, Kind::edge_edge),
                                            ::testing::Values(0.0, 0.1)));

}  // namespace
}  // namespace hpccd
