// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, with HPCCD_ISA naming the set. Boxes are compared 16 at a time.

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "base/hd.h"
#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// A box to compare with: its bounds, in the order of a group's rows, each `stride` numbers behind the one before.
template <std::uint32_t stride>
struct Bounds {
  const float* at;
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row * stride]; }
};

// Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
HPCCD_HD Bounds<BoxGroup::width> bounds_at(const BoxGroup* groups, std::uint32_t i) {
  return {groups[i / BoxGroup::width].rows[0] + i % BoxGroup::width};
}
HPCCD_HD Bounds<1> bounds_of(const Node& node) { return {node.box.t0.low}; }

#if defined(__AVX512F__)

// A group in registers, where it stays while it is compared with many boxes.
struct Group {
  __m512 rows[n_bounds];
};
HPCCD_HD Group load(const BoxGroup& group) {
  Group g;
  for (std::uint32_t r = 0; r < n_bounds; ++r) g.rows[r] = _mm512_load_ps(group.rows[r]);
  return g;
}

// Bit j: box j of the group overlaps b (MotionBox::overlaps).
template <class Bounds>
HPCCD_HD unsigned overlapping(const Group& g, Bounds b) {
  const auto bound = [&](std::uint32_t row) { return _mm512_set1_ps(b[row]); };
  __mmask16 apart = 0;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const __mmask16 below = _mm512_cmp_ps_mask(g.rows[high(0, axis)], bound(low(0, axis)), _CMP_LT_OQ);
    const __mmask16 above = _mm512_cmp_ps_mask(g.rows[low(0, axis)], bound(high(0, axis)), _CMP_GT_OQ);
    apart = _kor_mask16(apart, _mm512_mask_cmp_ps_mask(below, g.rows[high(1, axis)], bound(low(1, axis)), _CMP_LT_OQ));
    apart = _kor_mask16(apart, _mm512_mask_cmp_ps_mask(above, g.rows[low(1, axis)], bound(high(1, axis)), _CMP_GT_OQ));
  }
  return static_cast<__mmask16>(~apart);
}

#else

using Group = const BoxGroup&;
HPCCD_HD Group load(const BoxGroup& group) { return group; }

// Some of a row's numbers at a time.
#if defined(__AVX2__)
using Part = __m256;
HPCCD_HD Part part(const float* row) { return _mm256_load_ps(row); }
HPCCD_HD Part all(float x) { return _mm256_set1_ps(x); }
HPCCD_HD Part less(Part a, Part b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
HPCCD_HD Part both(Part a, Part b) { return _mm256_and_ps(a, b); }
HPCCD_HD Part either(Part a, Part b) { return _mm256_or_ps(a, b); }
HPCCD_HD unsigned lanes_of(Part a) { return static_cast<unsigned>(_mm256_movemask_ps(a)); }
#elif defined(__SSE2__)
using Part = __m128;
HPCCD_HD Part part(const float* row) { return _mm_load_ps(row); }
HPCCD_HD Part all(float x) { return _mm_set1_ps(x); }
HPCCD_HD Part less(Part a, Part b) { return _mm_cmplt_ps(a, b); }
HPCCD_HD Part both(Part a, Part b) { return _mm_and_ps(a, b); }
HPCCD_HD Part either(Part a, Part b) { return _mm_or_ps(a, b); }
HPCCD_HD unsigned lanes_of(Part a) { return static_cast<unsigned>(_mm_movemask_ps(a)); }
#else
struct Part {
  float x;
};
HPCCD_HD Part part(const float* row) { return {*row}; }
HPCCD_HD Part all(float x) { return {x}; }
HPCCD_HD bool less(Part a, Part b) { return a.x < b.x; }
HPCCD_HD bool both(bool a, bool b) { return a & b; }
HPCCD_HD bool either(bool a, bool b) { return a | b; }
HPCCD_HD unsigned lanes_of(bool a) { return a; }
#endif

template <class Bounds>
HPCCD_HD unsigned overlapping(Group g, Bounds b) {
  constexpr std::uint32_t n = sizeof(Part) / sizeof(float);
  unsigned bits = 0;
  for (std::uint32_t i = 0; i < BoxGroup::width; i += n) {
    const auto in_order = [&](std::uint32_t axis) {
      const auto of_group = [&](std::uint32_t row) { return part(g.rows[row] + i); };
      const auto below = both(less(of_group(high(0, axis)), all(b[low(0, axis)])),
                              less(of_group(high(1, axis)), all(b[low(1, axis)])));
      const auto above = both(less(all(b[high(0, axis)]), of_group(low(0, axis))),
                              less(all(b[high(1, axis)]), of_group(low(1, axis))));
      return either(below, above);
    };
    bits |= lanes_of(either(either(in_order(0), in_order(1)), in_order(2))) << i;
  }
  return ~bits & 0xFFFF;
}

#endif

// Bit j: number i + j equals x.
HPCCD_HD unsigned equal(const std::uint32_t* numbers, std::uint32_t i, std::uint32_t x) {
#if defined(__AVX512F__)
  return _mm512_cmpeq_epi32_mask(_mm512_loadu_si512(numbers + i), _mm512_set1_epi32(static_cast<int>(x)));
#elif defined(__AVX2__)
  unsigned bits = 0;
  for (int half = 0; half < 2; ++half) {
    const auto v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers + i + 8 * half));
    const auto e = _mm256_cmpeq_epi32(v, _mm256_set1_epi32(static_cast<int>(x)));
    bits |= static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(e))) << (8 * half);
  }
  return bits;
#else
  unsigned bits = 0;
  for (unsigned j = 0; j < 16; ++j) bits |= static_cast<unsigned>(numbers[i + j] == x) << j;
  return bits;
#endif
}

// The lanes of the group [i, i + 16) that lie in [begin, end).
HPCCD_HD unsigned lanes_in(std::uint32_t i, std::uint32_t begin, std::uint32_t end) {
  unsigned m = end - i >= 16 ? 0xFFFFu : (1u << (end - i)) - 1;
  if (begin > i) m &= begin - i >= 16 ? 0u : ~((1u << (begin - i)) - 1);
  return m;
}

// Appends the pairs of `number` with those of the 16 features from `others` on that are in m.
template <bool ascending>
HPCCD_HD void append(CandidateBuffer& out, std::uint32_t number, const std::uint32_t* others, unsigned m) {
#if defined(__AVX512F__)
  const __m512i x = _mm512_set1_epi32(static_cast<int>(number)), y = _mm512_loadu_si512(others);
  const auto lanes = static_cast<__mmask16>(m);
  _mm512_storeu_si512(out.first + out.n, _mm512_maskz_compress_epi32(lanes, ascending ? _mm512_min_epu32(x, y) : x));
  _mm512_storeu_si512(out.second + out.n, _mm512_maskz_compress_epi32(lanes, ascending ? _mm512_max_epu32(x, y) : y));
  out.n += static_cast<unsigned>(__builtin_popcount(m));
#else
  for (; m; m &= m - 1) {
    const std::uint32_t other = others[__builtin_ctz(m)];
    const bool swapped = ascending && other < number;
    out.first[out.n] = swapped ? other : number;
    out.second[out.n++] = swapped ? number : other;
  }
#endif
}

// Features of one leaf that overlap the other leaf's box: a bit each, by group.
struct Near {
  static constexpr std::uint32_t most_groups = (4 * Tree::leaf_size + BoxGroup::width - 1) / BoxGroup::width;
  unsigned lanes[most_groups] = {};
  unsigned count = 0;
};

// Of features begin to end - 1 of the groups.
HPCCD_HD Near near(const BoxGroup* groups, std::uint32_t begin, std::uint32_t end, const Node& other) {
  Near n;
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    n.lanes[group] = overlapping(load(groups[group]), bounds_of(other)) & lanes_in(i, begin, end),
    n.count += static_cast<unsigned>(__builtin_popcount(n.lanes[group]));
  return n;
}

// f(number) for each of them.
template <class Function>
HPCCD_HD void for_each(const Near& n, std::uint32_t end, Function&& f) {
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    for (unsigned lanes = n.lanes[group]; lanes; lanes &= lanes - 1) f(i + static_cast<unsigned>(__builtin_ctz(lanes)));
}

// Edges of a that are near b, against all edges of b.
HPCCD_HD void near_edges(const Tree& tree, const Near& near_a, const LeafRange& a, const LeafRange& b,
                         CandidateBuffer& out) {
  const bool same = &a == &b;
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const std::uint32_t n_a = a.n_edges(), n_b = b.n_edges();
  const std::uint32_t *end0 = tree.edge_ends[0].data(), *end1 = tree.edge_ends[1].data();
  const std::uint32_t* edge = tree.edge_of_slot.data();
  for (std::uint32_t i = 0; i < n_b; i += BoxGroup::width) {
    const Group group = load(groups_b[i / BoxGroup::width]);
    const std::uint32_t slot = b.first_edge + i;
    for_each(near_a, n_a, [&](std::uint32_t k) {
      unsigned m = overlapping(group, bounds_at(groups_a, k)) & lanes_in(i, same ? k + 1 : 0, n_b);
      if (!m) return;
      const std::uint32_t v0 = end0[a.first_edge + k], v1 = end1[a.first_edge + k];
      m &= ~(equal(end0, slot, v0) | equal(end0, slot, v1) | equal(end1, slot, v0) | equal(end1, slot, v1));
      append<true>(out, edge[a.first_edge + k], edge + slot, m);
    });
  }
}

HPCCD_HD void edge_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_a,
                         const Node& node_b, CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const Near near_a = near(groups_a, 0, a.n_edges(), node_b);
  if (!near_a.count) return;
  if (&a == &b) return near_edges(tree, near_a, a, a, out);
  const Near near_b = near(groups_b, 0, b.n_edges(), node_a);
  if (!near_b.count) return;
  // One by one the fewer, in groups the others.
  const bool by_a = near_a.count <= near_b.count;
  near_edges(tree, by_a ? near_a : near_b, by_a ? a : b, by_a ? b : a, out);
}

// Vertices of a against faces of b.
HPCCD_HD void vertex_face_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_b,
                                CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.surface_group(), &group_b = all[b.surface_group()];
  const std::uint32_t first_a = a.first_vertex_lane(), end_a = first_a + a.n_vertices();
  static_assert(Tree::leaf_size <= BoxGroup::width);
  const Near near_a = near(groups_a, first_a, end_a, node_b);
  if (!near_a.count) return;
  const std::uint32_t* vertex = tree.vertex_of_slot.data() + a.first_vertex;
  const std::uint32_t* face = tree.face_of_slot.data() + b.first_face;
  const std::uint32_t *c0 = tree.face_corners[0].data() + b.first_face,
                      *c1 = tree.face_corners[1].data() + b.first_face,
                      *c2 = tree.face_corners[2].data() + b.first_face;
  const Group faces = load(group_b);
  for_each(near_a, end_a, [&](std::uint32_t k) {
    unsigned m = overlapping(faces, bounds_at(groups_a, k)) & lanes_in(0, 0, b.n_faces());
    if (!m) return;
    const std::uint32_t v = vertex[k - first_a];
    m &= ~(equal(c0, 0, v) | equal(c1, 0, v) | equal(c2, 0, v));
    append<false>(out, v, face, m);
  });
}

}  // namespace

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_edge,
                CandidateBuffer& vertex_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  edge_pairs(tree, a, b, node_a, node_b, edge_edge);
  vertex_face_pairs(tree, a, b, node_b, vertex_face);
  if (&a != &b) vertex_face_pairs(tree, b, a, node_a, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
