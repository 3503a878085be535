// SPDX-License-Identifier: Apache-2.0
// The filter against integer arithmetic: what it decides is right, it leaves nothing open that is far from touching,
// and every instruction set decides the same.
#include "elementary/intersection_batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "base/simd.h"
#include "elementary/exact/intersection.h"

namespace hpccd {
namespace {

enum class Source { reals, lattice, touching, in_a_plane };

class Queries {
 public:
  Queries(Source source, double scale) : source_(source), scale_(scale) {}

  std::vector<VertexMotion> operator()(std::uint32_t n) {
    std::vector<VertexMotion> vertices(5 * n);
    for (std::uint32_t i = 0; i < n; ++i) {
      fill(&vertices[5 * i]);
      for (int corner = 0; corner < 5; ++corner)
        for (int k = 0; k < 3; ++k) {
          vertices[5 * i + corner].t0[k] *= scale_;
          vertices[5 * i + corner].t1[k] = real();  // of no concern
        }
    }
    return vertices;
  }

 private:
  void fill(VertexMotion* q) {
    double along[2][3];
    for (auto& v : along)
      for (double& x : v) x = real();
    const bool flat = random_() % 3 == 0;
    for (int corner = 0; corner < 5; ++corner) {
      const double s = real(), t = real();
      for (int k = 0; k < 3; ++k) {
        double& x = q[corner].t0[k];
        if (source_ == Source::in_a_plane)
          x = 3 + s * along[0][k] + t * along[1][k];
        else if (source_ == Source::lattice)
          x = flat && k == 2 ? 0 : static_cast<double>(random_() % 5);
        else
          x = real();
      }
    }
    if (source_ != Source::touching) return;
    // The edge ends in the face or on its border, but for rounding.
    const double x = std::fabs(real()), y = random_() % 2 ? 1 - x : 0.5 * (1 - x);
    for (int k = 0; k < 3; ++k) q[1].t0[k] = q[2].t0[k] + x * (q[3].t0[k] - q[2].t0[k]) + y * (q[4].t0[k] - q[2].t0[k]);
  }
  double real() { return std::uniform_real_distribution<double>(-1, 1)(random_); }

  Source source_;
  double scale_;
  std::mt19937_64 random_{13};
};

struct Case {
  const char* name;
  Source source;
  double scale;
  double most_undecided;  // a share
};

struct IntersectionBatchTest : testing::TestWithParam<Case> {
  std::vector<std::array<std::uint32_t, 2>> edges{batch_capacity};
  std::vector<std::array<std::uint32_t, 3>> faces{batch_capacity};
  std::vector<std::uint32_t> numbers;
  std::unique_ptr<BatchResult> result = std::make_unique<BatchResult>();

  IntersectionBatchTest() {
    for (std::uint32_t i = 0; i < batch_capacity; ++i) {
      edges[i] = {5 * i, 5 * i + 1}, faces[i] = {5 * i + 2, 5 * i + 3, 5 * i + 4};
      numbers.push_back(i);
    }
  }

  enum class Answer { no, yes, undecided };
  std::vector<Answer> by(Simd simd, const Geometry& g, std::uint32_t n) {
    result->counts = {};
    intersection_batch(simd)(g, numbers.data(), numbers.data(), n, *result);
    const BatchCounts& c = result->counts;
    EXPECT_EQ(c.tested, n);
    EXPECT_EQ(c.coplanarity + c.projection + c.contacts + c.undecided, n);
    EXPECT_TRUE(std::is_sorted(result->contact, result->contact + result->n_contacts));
    EXPECT_TRUE(std::is_sorted(result->undecided, result->undecided + result->n_undecided));
    std::vector<Answer> answers(n, Answer::no);
    for (std::uint32_t i = 0; i < result->n_contacts; ++i) answers[result->contact[i]] = Answer::yes;
    for (std::uint32_t i = 0; i < result->n_undecided; ++i) answers[result->undecided[i]] = Answer::undecided;
    return answers;
  }
};

TEST_P(IntersectionBatchTest, DecidesAsIntegersDo) {
  Queries queries(GetParam().source, GetParam().scale);
  std::size_t tested = 0, undecided = 0, intersect = 0;
  for (int batch = 0; batch < 20; ++batch) {
    const std::uint32_t n = batch_capacity - 3 * (batch % 5);  // lanes that no pair fills
    const auto vertices = queries(n);
    const Geometry g{vertices.data(), edges.data(), faces.data()};
    const auto answers = by(Simd::scalar, g, n);
    for (const Simd simd : simd_levels()) ASSERT_EQ(by(simd, g, n), answers) << name_of(simd);
    for (std::uint32_t i = 0; i < n; ++i) {
      Vec3<double> q[5];
      edge_face_positions(g, i, i, q);
      const bool truth = exact::intersect(q);
      if (answers[i] == Answer::undecided)
        ++undecided;
      else
        ASSERT_EQ(answers[i] == Answer::yes, truth) << "batch " << batch << ", query " << i;
      intersect += truth;
    }
    tested += n;
  }
  EXPECT_GT(intersect, tested / 50);
  EXPECT_LE(static_cast<double>(undecided), GetParam().most_undecided * static_cast<double>(tested));
}

// Far from one, volumes would under- or overflow: there everything is left to integers.
INSTANTIATE_TEST_SUITE_P(
    Sources, IntersectionBatchTest,
    testing::Values(Case{"Reals", Source::reals, 1, 0}, Case{"Small", Source::reals, 0x1p-200, 0},
                    Case{"TooSmall", Source::reals, 0x1p-300, 1}, Case{"TooLarge", Source::reals, 0x1p400, 1},
                    Case{"Underflow", Source::touching, 0x1p-357, 1}, Case{"Lattice", Source::lattice, 1, 0.6},
                    Case{"Touching", Source::touching, 1, 1}, Case{"InAPlane", Source::in_a_plane, 1, 0.7},
                    Case{"SmallInAPlane", Source::in_a_plane, 0x1p-200, 0.7}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace hpccd
