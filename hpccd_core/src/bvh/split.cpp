// SPDX-License-Identifier: Apache-2.0
#include "bvh/split.h"

#include <algorithm>
#include <array>
#include <vector>

#include "bvh/box.h"

namespace hpccd {
namespace {

Box box_of(const Centroid* set, std::uint32_t n) {
  Box b;
  for (std::uint32_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      b.low[k] = std::min(b.low[k], set[i].center[k]);
      b.high[k] = std::max(b.high[k], set[i].center[k]);
    }
  return b;
}

int widest_axis(const Box& b) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (b.high[k] - b.low[k] > b.high[axis] - b.low[axis]) axis = k;
  return axis;
}

void split_along(int axis, Centroid* set, std::uint32_t n, std::uint32_t left, const Cancellation& cancellation) {
  const auto before = [axis](const Centroid& a, const Centroid& b) {
    const float xa = a.center[axis], xb = b.center[axis];
    return xa < xb || (xa == xb && a.number < b.number);
  };
  constexpr std::uint32_t many = 1 << 16;  // if all centroids coincide
  if (n < many)
    std::nth_element(set, set + left, set + n, before);
  else
    std::nth_element(set, set + left, set + n, heeding(cancellation, before));
}

// Equal intervals along an axis. Rounding keeps the order, so no element of a bucket is below an element of the
// previous one.
class Buckets {
 public:
  static constexpr std::uint32_t number = 1024;

  Buckets(const Box& b, int axis)
      : axis_(axis), low_(b.low[axis]), per_length_(b.high[axis] > low_ ? number / (b.high[axis] - low_) : 0) {}

  std::uint32_t of(const Centroid& p) const {
    return std::min(number - 1, static_cast<std::uint32_t>((p.center[axis_] - low_) * per_length_));
  }

 private:
  int axis_;
  double low_, per_length_;  // the smallest length that a float can have would overflow one
};

// Part of a set: its counts, and the positions of its next elements below, in and above the bucket that is split.
struct Piece {
  std::uint32_t begin, end;
  Box box;
  std::array<std::uint32_t, Buckets::number> count;
  std::uint32_t next[3];
};

// Counts by bucket, moves each element to its side of the bucket with the split, and sorts that bucket only, without
// data-dependent branches. for_pieces(f) calls f(piece) for each piece.
template <class ForPieces>
void split_by_buckets(Centroid* set, std::uint32_t left, Centroid* scratch, std::vector<Piece>& pieces,
                      const Cancellation& cancellation, ForPieces&& for_pieces) {
  for_pieces([&](Piece& p) { p.box = box_of(set + p.begin, p.end - p.begin); });
  Box whole;
  for (const Piece& p : pieces) whole.include(p.box);
  const int axis = widest_axis(whole);
  const Buckets buckets(whole, axis);
  for_pieces([&](Piece& p) {
    p.count.fill(0);
    for (std::uint32_t i = p.begin; i < p.end; ++i) ++p.count[buckets.of(set[i])];
  });

  std::uint32_t cut = 0, below = 0, inside = 0;
  for (;; ++cut, below += inside) {
    inside = 0;
    for (const Piece& p : pieces) inside += p.count[cut];
    if (left < below + inside) break;
  }
  const auto side_of = [cut](std::uint32_t bucket) { return (bucket >= cut) + (bucket > cut); };
  std::uint32_t next[3] = {0, below, below + inside};
  for (Piece& p : pieces) {
    std::copy_n(next, 3, p.next);
    for (std::uint32_t b = 0; b < Buckets::number; ++b) next[side_of(b)] += p.count[b];
  }
  for_pieces([&](Piece& p) {
    for (std::uint32_t i = p.begin; i < p.end; ++i) scratch[p.next[side_of(buckets.of(set[i]))]++] = set[i];
  });
  for_pieces([&](Piece& p) { std::copy(scratch + p.begin, scratch + p.end, set + p.begin); });
  if (left > below) split_along(axis, set + below, inside, left - below, cancellation);
}

// Pieces with their ranges only.
std::vector<Piece> pieces_of(std::uint32_t n, std::size_t number) {
  std::vector<Piece> pieces(number);
  for (std::size_t p = 0; p < number; ++p) {
    pieces[p].begin = static_cast<std::uint32_t>(n * p / number);
    pieces[p].end = static_cast<std::uint32_t>(n * (p + 1) / number);
  }
  return pieces;
}

}  // namespace

void split(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch, const Cancellation& cancellation) {
  constexpr std::uint32_t few = 2 * Buckets::number;  // buckets cost more for small sets
  if (n < few) return split_along(widest_axis(box_of(set, n)), set, n, left, cancellation);
  constexpr std::uint32_t longest_piece = 1 << 18;  // 1 ms
  std::vector<Piece> pieces = pieces_of(n, n / longest_piece + 1);
  split_by_buckets(set, left, scratch, pieces, cancellation, [&](auto&& work) {
    in_pieces(cancellation, pieces.size(), 1, [&](std::size_t p, std::size_t) { work(pieces[p]); });
  });
}

void split_together(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch, ThreadPool& pool) {
  std::vector<Piece> pieces = pieces_of(n, static_cast<std::size_t>(4 * pool.size()));
  split_by_buckets(set, left, scratch, pieces, pool.cancellation(), [&](auto&& work) {
    parallel_for_each(pool, pieces.size(), [&](std::size_t p) { work(pieces[p]); });
  });
}

}  // namespace hpccd
