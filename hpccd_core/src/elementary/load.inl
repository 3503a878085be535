// SPDX-License-Identifier: Apache-2.0
// Brings the vectors p, a, b of several pairs (motion.h) from rows of vertices into lanes. Part of pair_lanes.inl.
// Subtractions are done a row at a time (both ends of a motion at once), then rows are turned into lanes.

// Both ends: a row of eight.
HPCCD_HD const double* row_of(const VertexMotion& v) { return reinterpret_cast<const double*>(&v); }

template <Kind kind>
HPCCD_HD Motion<Double> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, Double*) {
  using S = Spans<kind>;
  MotionRow p[double_width], a[double_width], b[double_width];
  for (int lane = 0; lane < double_width; ++lane) {
    std::uint32_t v[4];
    pair_vertices<kind>(g, first[lane], second[lane], v);
    const auto span = [&](int to, int from) {
      return difference(row_of(g.vertices[v[to]]), row_of(g.vertices[v[from]]));
    };
    p[lane] = span(S::p_to, S::p_from), a[lane] = span(S::a_to, S::a_from), b[lane] = span(S::b_to, S::b_from);
  }
  const MotionLanes p_lanes = transposed(p), a_lanes = transposed(a), b_lanes = transposed(b);
  return {p_lanes.t0, a_lanes.t0, b_lanes.t0, p_lanes.t1, a_lanes.t1, b_lanes.t1};
}

// In single precision: differences are taken in double precision and brought to about one by the scene's scale first.
template <Kind kind>
HPCCD_HD Motion<Single> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, Single*) {
  constexpr int n = RealTraits<Single>::width / double_width;
  Motion<Double> parts[n];
  for (int i = 0; i < n; ++i)
    parts[i] = load<kind>(g, first + i * double_width, second + i * double_width, static_cast<Double*>(nullptr));
  const auto vector = [&](Vec3<Double> Motion<Double>::* v) {
    Double x[n], y[n], z[n];
    for (int i = 0; i < n; ++i) x[i] = (parts[i].*v).x, y[i] = (parts[i].*v).y, z[i] = (parts[i].*v).z;
    return Vec3<Single>{narrowed(x, g.scale), narrowed(y, g.scale), narrowed(z, g.scale)};
  };
  using M = Motion<Double>;
  return {vector(&M::p0), vector(&M::a0), vector(&M::b0), vector(&M::p1), vector(&M::a1), vector(&M::b1)};
}
