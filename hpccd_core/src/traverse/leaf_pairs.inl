// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, with HPCCD_ISA naming the set. Boxes are compared 16 at a time.

#if defined(__AVX512F__) || defined(__AVX2__)
#include <immintrin.h>
#endif

#include "base/hd.h"
#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

// Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
struct Boxes {
  const float *low[3], *high[3];
};

HPCCD_HD Boxes pointers(const BoxArrays& b) {
  return {{b.low[0].data(), b.low[1].data(), b.low[2].data()}, {b.high[0].data(), b.high[1].data(), b.high[2].data()}};
}

// Bit j: box i + j overlaps b.
HPCCD_HD unsigned overlapping(const Boxes& s, std::uint32_t i, const Box& b) {
#if defined(__AVX512F__)
  __mmask16 m = 0xFFFF;
  for (int k = 0; k < 3; ++k) {
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(s.low[k] + i), _mm512_set1_ps(b.high[k]), _CMP_LE_OQ);
    m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(s.high[k] + i), _mm512_set1_ps(b.low[k]), _CMP_GE_OQ);
  }
  return m;
#elif defined(__AVX2__)
  unsigned bits = 0;
  for (int half = 0; half < 2; ++half) {
    __m256 m = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
    for (int k = 0; k < 3; ++k) {
      m = _mm256_and_ps(m, _mm256_cmp_ps(_mm256_loadu_ps(s.low[k] + i + 8 * half), _mm256_set1_ps(b.high[k]), _CMP_LE_OQ));
      m = _mm256_and_ps(m, _mm256_cmp_ps(_mm256_loadu_ps(s.high[k] + i + 8 * half), _mm256_set1_ps(b.low[k]), _CMP_GE_OQ));
    }
    bits |= static_cast<unsigned>(_mm256_movemask_ps(m)) << (8 * half);
  }
  return bits;
#else
  unsigned bits = 0;
  for (unsigned j = 0; j < 16; ++j) {
    const bool all = (s.low[0][i + j] <= b.high[0]) & (s.high[0][i + j] >= b.low[0]) &
                     (s.low[1][i + j] <= b.high[1]) & (s.high[1][i + j] >= b.low[1]) &
                     (s.low[2][i + j] <= b.high[2]) & (s.high[2][i + j] >= b.low[2]);
    bits |= static_cast<unsigned>(all) << j;
  }
  return bits;
#endif
}

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

HPCCD_HD Box box_at(const Boxes& s, std::uint32_t i) {
  Box b;
  for (int k = 0; k < 3; ++k) b.low[k] = s.low[k][i], b.high[k] = s.high[k][i];
  return b;
}

HPCCD_HD bool overlap(const Box& a, const Box& b) {
  return (a.low[0] <= b.high[0]) & (b.low[0] <= a.high[0]) & (a.low[1] <= b.high[1]) & (b.low[1] <= a.high[1]) &
         (a.low[2] <= b.high[2]) & (b.low[2] <= a.high[2]);
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

HPCCD_HD void edge_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, bool same, const Box& box_b,
                         CandidateBuffer& out) {
  const Boxes boxes = pointers(tree.edge_boxes);
  const std::uint32_t *end0 = tree.edge_ends[0].data(), *end1 = tree.edge_ends[1].data();
  const std::uint32_t* edge = tree.edge_of_slot.data();
  for (std::uint32_t group = a.first_edge; group < a.end_edge; group += 16)
    for (unsigned near = overlapping(boxes, group, box_b) & lanes_in(group, group, a.end_edge); near; near &= near - 1) {
      const std::uint32_t s = group + static_cast<unsigned>(__builtin_ctz(near));
      const Box box = box_at(boxes, s);
      const std::uint32_t v0 = end0[s], v1 = end1[s];
      const std::uint32_t begin = same ? s + 1 : b.first_edge;
      for (std::uint32_t i = begin; i < b.end_edge; i += 16) {
        unsigned m = overlapping(boxes, i, box) & lanes_in(i, begin, b.end_edge);
        m &= ~(equal(end0, i, v0) | equal(end0, i, v1) | equal(end1, i, v0) | equal(end1, i, v1));
        append<true>(out, edge[s], edge + i, m);
      }
    }
}

// Vertices of a against faces of b.
HPCCD_HD void vertex_face_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, const Box& box_b,
                                CandidateBuffer& out) {
  const Boxes vertex_boxes = pointers(tree.vertex_boxes), boxes = pointers(tree.face_boxes);
  const std::uint32_t* vertex = tree.vertex_of_slot.data();
  const std::uint32_t* face = tree.face_of_slot.data();
  const std::uint32_t *c0 = tree.face_corners[0].data(), *c1 = tree.face_corners[1].data(),
                      *c2 = tree.face_corners[2].data();
  for (std::uint32_t group = a.first_vertex; group < a.end_vertex; group += 16)
    for (unsigned near = overlapping(vertex_boxes, group, box_b) & lanes_in(group, group, a.end_vertex); near;
         near &= near - 1) {
      const std::uint32_t s = group + static_cast<unsigned>(__builtin_ctz(near));
      const Box box = box_at(vertex_boxes, s);
      const std::uint32_t v = vertex[s];
      for (std::uint32_t i = b.first_face; i < b.end_face; i += 16) {
        unsigned m = overlapping(boxes, i, box) & lanes_in(i, i, b.end_face);
        m &= ~(equal(c0, i, v) | equal(c1, i, v) | equal(c2, i, v));
        append<false>(out, v, face + i, m);
      }
    }
}

}  // namespace

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_edge,
                CandidateBuffer& vertex_face) {
  const Node* nodes = tree.nodes.data();
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const bool same = &a == &b;
  const Box &box_a = nodes[leaf_nodes[&a - leaves]].box, &box_b = nodes[leaf_nodes[&b - leaves]].box;
  edge_pairs(tree, a, b, same, box_b, edge_edge);
  vertex_face_pairs(tree, a, b, box_b, vertex_face);
  if (!same) vertex_face_pairs(tree, b, a, box_a, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
