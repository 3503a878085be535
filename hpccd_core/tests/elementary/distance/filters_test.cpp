// SPDX-License-Identifier: Apache-2.0
// Proofs of the filters of distance queries, against integers, on as many pairs as the variable
// HPCCD_FILTER_QUERIES says: 20,000 where it is not set.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>

#include "base/simd.h"
#include "elementary/distance/distance_batch.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/distance/separation_test.h"
#include "elementary/exact/distance.h"
#include "elementary/exact/separation.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

long wanted() {
  const char* text = std::getenv("HPCCD_FILTER_QUERIES");
  return text ? std::atol(text) : 20000;
}

class PairSource {
 public:
  explicit PairSource(Kind kind) : kind_(kind) {}

  // Four points at both ends of the step, and a distance that is often nearly or exactly theirs.
  void next(V t0[4], V t1[4], double& d) {
    const unsigned shape = static_cast<unsigned>(random_() % 5), motion = static_cast<unsigned>(random_() % 4);
    const double unit = std::ldexp(1.0, static_cast<int>(random_() % 41) - 20);
    for (int i = 0; i < 4; ++i) t0[i] = unit * point(shape);
    const V shift = unit * point(shape);
    for (int i = 0; i < 4; ++i) {
      if (motion == 0) t1[i] = unit * point(shape);
      if (motion == 1) t1[i] = t0[i] + shift;
      if (motion == 2) t1[i] = t0[i] + 1e-3 * (unit * point(shape));
      if (motion == 3) t1[i] = i == 0 ? t0[i] + shift : t0[i];
    }
    const double at_start = exact::distance(kind_, t0), at_end = exact::distance(kind_, t1);
    const double some = at_start + real() * (at_end - at_start);
    const double choices[] = {0.5 * unit, at_start, at_end, some, 0.01 * unit, 2 * unit};
    d = choices[random_() % 6] * (1 + 0x1p-52 * (random_() % 2 ? 0.0 : static_cast<double>(random_() % 129) - 64));
    if (!(d > 0)) d = unit;
  }

 private:
  double real() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  V point(unsigned shape) {
    const double x = real(), y = real(), z = real();
    if (shape == 1) return {std::round(3 * x), std::round(3 * y), std::round(3 * z)};
    if (shape == 2) return {x, 1e-4 * y, 1e-7 * z};
    if (shape == 3) return {x + 1e6, y, z - 3e5};
    if (shape == 4) return {x, y, 0.25 * std::round(2 * z)};
    return {x, y, z};
  }

  Kind kind_;
  std::mt19937_64 random_{13};
};

// Batches of pairs, each of features of its own: pair i has vertices 4 i to 4 i + 3.
struct Batch {
  std::vector<VertexMotion> vertices{4 * batch_capacity};
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint32_t> first, second;
  std::vector<double> d = std::vector<double>(batch_capacity);
  std::vector<std::array<V, 4>> t0{batch_capacity}, t1{batch_capacity};

  explicit Batch(Kind kind) {
    for (std::uint32_t i = 0; i < batch_capacity; ++i) {
      const std::uint32_t v = 4 * i;
      edges.push_back({v, v + 1}), edges.push_back({v + 2, v + 3});
      faces.push_back({v + 1, v + 2, v + 3});
      first.push_back(kind == Kind::vertex_face ? v : 2 * i);
      second.push_back(kind == Kind::vertex_face ? i : 2 * i + 1);
    }
  }
  void fill(PairSource& source) {
    for (std::uint32_t i = 0; i < batch_capacity; ++i) {
      source.next(t0[i].data(), t1[i].data(), d[i]);
      for (std::uint32_t k = 0; k < 4; ++k) {
        const V &a = t0[i][k], &b = t1[i][k];
        vertices[4 * i + k] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}};
      }
    }
  }
  std::unique_ptr<BatchResult> ask(BatchTest test, Kind kind) const {
    Geometry g{vertices.data(), edges.data(), faces.data()};
    g.separations.of_candidates = d.data();
    auto result = std::make_unique<BatchResult>();
    test(g, kind, first.data(), second.data(), batch_capacity, *result);
    return result;
  }
};

enum class Verdict { none, contact, undecided };

struct Verdicts {
  std::vector<Verdict> of = std::vector<Verdict>(batch_capacity, Verdict::none);
  std::vector<double> value = std::vector<double>(batch_capacity);

  explicit Verdicts(const BatchResult& r) {
    for (std::uint32_t i = 0; i < r.n_contacts; ++i)
      of[r.contact[i]] = Verdict::contact, value[r.contact[i]] = r.toc[i];
    for (std::uint32_t i = 0; i < r.n_undecided; ++i) of[r.undecided[i]] = Verdict::undecided;
  }
};

class DistanceFilters : public ::testing::TestWithParam<Kind> {
 protected:
  // check(i, batch, verdicts) of each pair that is decided.
  template <class Check>
  void on_all(BatchTest test, Check&& check) {
    PairSource source(GetParam());
    Batch batch(GetParam());
    long decided = 0, contacts = 0, asked = 0;
    while (asked < wanted()) {
      batch.fill(source);
      const Verdicts found(*batch.ask(test, GetParam()));
      for (std::uint32_t i = 0; i < batch_capacity; ++i) {
        if (found.of[i] == Verdict::undecided) continue;
        check(batch.t0[i].data(), batch.t1[i].data(), batch.d[i], found.of[i] == Verdict::contact, found.value[i]);
        ASSERT_FALSE(HasFatalFailure()) << "pair " << asked + i;
        ++decided, contacts += found.of[i] == Verdict::contact;
      }
      asked += batch_capacity;
    }
    EXPECT_GT(decided, asked / 2) << contacts << " contacts";
    EXPECT_GT(contacts, asked / 20);
    EXPECT_LT(contacts, decided - asked / 20);
  }
};

TEST_P(DistanceFilters, SeparationIsWhatIntegersDecide) {
  on_all(separation_batch(resolve(Simd::automatic)), [&](const V* t0, const V* t1, double d, bool contact, double toc) {
    const auto exact = exact::earliest_within(GetParam(), t0, t1, d);
    ASSERT_EQ(contact, exact.has_value());
    if (!exact) return;
    ASSERT_LE(toc, *exact + 1e-18) << "never late";
    ASSERT_GE(toc, *exact - separation_toc_radius - 1e-18);
  });
}

TEST_P(DistanceFilters, ProximityIsWhatIntegersDecide) {
  on_all(proximity_batch(resolve(Simd::automatic)), [&](const V* t0, const V*, double d, bool near, double distance) {
    ASSERT_EQ(near, exact::within(GetParam(), t0, d));
    if (!near) return;
    double size = 0;
    for (int i = 0; i < 4; ++i) size = std::max(size, max_norm(t0[i] - t0[0]));
    ASSERT_NEAR(distance, exact::distance(GetParam(), t0), 1e-12 * size);
    ASSERT_LE(distance, d);
  });
}

INSTANTIATE_TEST_SUITE_P(Kinds, DistanceFilters, ::testing::Values(Kind::vertex_face, Kind::edge_edge));

}  // namespace
}  // namespace hpccd
