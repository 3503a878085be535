// SPDX-License-Identifier: Apache-2.0
// Loads the vectors p, a, b of several pairs (motion.h) from rows of vertices into lanes. Part of pair_lanes.inl.
// Subtractions are done a row at a time (both ends of a motion at once), then rows are transposed into lanes.

// Both ends: a row of eight numbers.
HPCCD_HD const double* row_of(const VertexMotion& v) { return reinterpret_cast<const double*>(&v); }

// vertices[lane]: the vertices of a pair, in the order of the public queries.
template <Kind kind>
HPCCD_HD Motion<Double> load(const Geometry& g, const std::uint32_t* const* vertices, Double*) {
  using S = Spans<kind>;
  MotionRow p[double_width], a[double_width], b[double_width];
  for (int lane = 0; lane < double_width; ++lane) {
    const std::uint32_t* v = vertices[lane];
    const auto span = [&](int to, int from) {
      return difference(row_of(g.vertices[v[to]]), row_of(g.vertices[v[from]]));
    };
    p[lane] = span(S::p_to, S::p_from), a[lane] = span(S::a_to, S::a_from), b[lane] = span(S::b_to, S::b_from);
  }
  const MotionLanes p_lanes = transposed(p), a_lanes = transposed(a), b_lanes = transposed(b);
  return {p_lanes.t0, a_lanes.t0, b_lanes.t0, p_lanes.t1, a_lanes.t1, b_lanes.t1};
}

// In single precision, from rounded coordinates.
HPCCD_HD const float* row_of(const RoundedMotion& v) { return v.t0; }

template <Kind kind>
HPCCD_HD Motion<Single> load(const Geometry& g, const std::uint32_t* const* vertices, Single*) {
  using S = Spans<kind>;
  RoundedRows rows[4];
  for (int i = 0; i < 4; ++i) rows[i] = rounded_rows([&](int lane) { return row_of(g.rounded[vertices[lane][i]]); });
  const auto span = [&](int to, int from) { return transposed(difference(rows[to], rows[from])); };
  const RoundedLanes p = span(S::p_to, S::p_from), a = span(S::a_to, S::a_from), b = span(S::b_to, S::b_from);
  return {p.t0, a.t0, b.t0, p.t1, a.t1, b.t1};
}

template <Kind kind, class R>
HPCCD_HD Motion<Twice<R>> load(const Geometry& g, const std::uint32_t* const* vertices, Twice<R>*) {
  constexpr int width = RealTraits<R>::width;
  const Motion<R> one = load<kind>(g, vertices, static_cast<R*>(nullptr));
  const Motion<R> other = load<kind>(g, vertices + width, static_cast<R*>(nullptr));
  const auto both = [](const Vec3<R>& a, const Vec3<R>& b) {
    return Vec3<Twice<R>>{{a.x, b.x}, {a.y, b.y}, {a.z, b.z}};
  };
  return {both(one.p0, other.p0), both(one.a0, other.a0), both(one.b0, other.b0),
          both(one.p1, other.p1), both(one.a1, other.a1), both(one.b1, other.b1)};
}
