// SPDX-License-Identifier: Apache-2.0
#include "solid/moved_pair.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <numeric>
#include <span>
#include <utility>

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"
#include "elementary/exact/vector.h"
#include "solid/closed.h"
#include "solid/crossing.h"
#include "solid/curve_order.h"

namespace hpccd {
namespace {

using V = Vec3<double>;
using exact::operator-;
// Bounds, with u = 2^-53 and all coordinates of magnitude 1 at most. The axes of a frame are rounded, and the third one
// is not quite the direction: an entry has an error of 4 u, a coordinate in the frame, a sum of three products, one of
// 3 (4 + 3) u = 21 u, or 2.4e-15; rounded up:
constexpr double frame_error = 4e-15;
// Faces or nodes of a mesh between two looks at a request to cancel: about 1 ms.
constexpr std::size_t grain = 1 << 13;

}  // namespace

MeshTopology topology_of(const Scene& scene, std::uint32_t number, const Cancellation& cancellation) {
  const Scene::Mesh& mesh = scene.meshes()[number];
  const std::span faces(scene.faces().data() + mesh.first_face, mesh.n_faces);
  std::vector<std::uint32_t> lowest(mesh.n_vertices);
  std::iota(lowest.begin(), lowest.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (lowest[v] != v) v = lowest[v] = lowest[lowest[v]];
    return v;
  };
  std::vector<char> seen(mesh.n_vertices, false);
  in_pieces(cancellation, faces.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (const auto& face : faces.subspan(begin, end - begin))
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = find(face[i] - mesh.first_vertex), w = find(face[(i + 1) % 3] - mesh.first_vertex);
        lowest[std::max(v, w)] = std::min(v, w);
        seen[face[i] - mesh.first_vertex] = true;
      }
  });
  MeshTopology topology{mesh.first_face, mesh.n_faces, is_closed(faces, cancellation), {}};
  for (std::uint32_t v = 0; v < lowest.size(); ++v)
    if (seen[v] && lowest[v] == v) topology.representatives.push_back(mesh.first_vertex + v);
  return topology;
}

MovedPair::MovedPair(const MotionBounds& snapshot, const Features& features, std::array<std::uint32_t, 2> meshes,
                     const MeshTopology& a, const MeshTopology& b, ThreadPool& pool)
    : snapshot_(snapshot), cancellation_(pool.cancellation()) {
  meshes_[0].topology = &a, meshes_[1].topology = &b;
  double largest = 0;
  for (const std::size_t side : {0u, 1u}) {
    const Extent& extent = snapshot.extent_of_mesh(meshes[side]);
    for (int k = 0; k < 3; ++k) largest = std::max({largest, std::fabs(extent.low[k]), std::fabs(extent.high[k])});
  }
  if (largest > 0) scale_ = std::ldexp(1.0, std::min(-1 - std::ilogb(largest), 1000));
  parallel_for_each(pool, 2, [&](std::size_t side) {
    build(meshes_[side], features, snapshot.extent_of_mesh(meshes[side]));
    fit(meshes_[side]);
  });
}

void MovedPair::build(BoxedMesh& mesh, const Features& features, const Extent& extent) const {
  constexpr std::size_t leaf_size = 8;
  const std::uint32_t first = mesh.topology->first_face, n = mesh.topology->n_faces;
  const double up = 3 * scale_;
  double size = 0;
  for (int k = 0; k < 3; ++k) size = std::max(size, up * extent.high[k] - up * extent.low[k]);
  const Curve curve({up * extent.low[0], up * extent.low[1], up * extent.low[2]}, size);
  std::vector<OnCurve> order(n);
  in_pieces(cancellation_, n, grain, [&](std::size_t begin, std::size_t end) {
    for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
      const auto& f = features.faces[first + i];
      order[i] = {curve.code(position(f[0]) + position(f[1]) + position(f[2])), i};
    }
  });
  sort_by_code(order, cancellation_);
  mesh.faces.reserve(n), mesh.face_numbers.reserve(n), mesh.nodes.reserve(n / 2 + 1);
  for (const OnCurve& place : order) {
    mesh.face_numbers.push_back(first + static_cast<std::uint32_t>(place.point));
    mesh.faces.push_back(features.faces[mesh.face_numbers.back()]);
  }
  mesh.nodes.push_back({{}, 0, 0, n});
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (i % grain == 0) heed();
    const auto [box, none, begin, end] = mesh.nodes[i];
    if (end - begin <= leaf_size) continue;
    // Between the halves of the smallest cell that contains all, or anywhere in the smallest of all.
    std::uint32_t middle = begin + (end - begin) / 2;
    const std::uint32_t low = order[begin].code, high = order[end - 1].code;
    if (low != high) {
      const std::uint32_t bit = std::bit_floor(low ^ high), half = high & ~(bit - 1);
      const auto at = std::ranges::lower_bound(order.begin() + begin, order.begin() + end, half, {}, &OnCurve::code);
      middle = static_cast<std::uint32_t>(at - order.begin());
    }
    mesh.nodes[i] = {{}, static_cast<std::uint32_t>(mesh.nodes.size()), 0, 0};
    mesh.nodes.push_back({{}, 0, begin, middle}), mesh.nodes.push_back({{}, 0, middle, end});
  }
}

void MovedPair::fit(BoxedMesh& mesh) const {
  for (std::size_t i = mesh.nodes.size(); i-- > 0;) {
    if (i % grain == 0) heed();
    BoxedMesh::Node& node = mesh.nodes[i];
    V low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
    const auto include = [&](const V& l, const V& h) {
      low = {std::min(low.x, l.x), std::min(low.y, l.y), std::min(low.z, l.z)};
      high = {std::max(high.x, h.x), std::max(high.y, h.y), std::max(high.z, h.z)};
    };
    for (std::uint32_t f = node.first_face; f < node.end_face; ++f)
      for (const std::uint32_t v : mesh.faces[f]) include(position(v), position(v));
    if (node.children)
      for (const std::uint32_t child : {node.children, node.children + 1})
        include(mesh.nodes[child].box.low, mesh.nodes[child].box.high);
    node.box = {low, high};
  }
}

const MovedPair::Bits& MovedPair::bits() const {
  if (!bits_) {
    exact::BitRange range;
    for (const BoxedMesh& mesh : meshes_)
      in_pieces(cancellation_, mesh.faces.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (const auto& face : std::span(mesh.faces).subspan(begin, end - begin))
          for (const std::uint32_t v : face)
            for (int k = 0; k < 3; ++k) range.include(exact::OddMantissa(snapshot_.vertices[v].t0[k]));
      });
    bits_ = Bits{range.low, range.bits()};
  }
  return *bits_;
}

// Times as fractions, decided in integers: those of coordinates with a common scale, and of the direction with another
// one. The scales cancel in comparisons.
class Translation::Exact {
 public:
  // Without memory of their own, for coordinates of most grids.
  using Wide = boost::multiprecision::number<
      boost::multiprecision::cpp_int_backend<1024, 1024, boost::multiprecision::signed_magnitude,
                                             boost::multiprecision::unchecked, void>,
      boost::multiprecision::et_off>;
  template <class Z>
  using Corner = exact::Vector<Z>;
  template <class Z>
  struct Fraction {
    Z over, under;  // under > 0
  };

  explicit Exact(const Translation& of) : of_(of), low_(of.pair_.bits().low) {
    exact::BitRange range;
    for (int k = 0; k < 3; ++k) range.include(exact::OddMantissa(exact::coordinate(of.given_, k)));
    direction_low_ = range.low;
    // With b bits of coordinates and c of the direction: a difference has b + 1, n = a x b 2 b + 3, a numerator
    // n . difference 3 b + 6, a denominator n . direction 2 b + c + 5, and their products are compared.
    narrow_ = 5 * of.pair_.bits().count + range.bits() + 16 < 1024;
  }

  template <class F>
  auto with_integers(F&& f) const {
    return narrow_ ? f(Wide()) : f(exact::Big());
  }

  template <class Z>
  Z integer(double x, int low) const {
    const exact::OddMantissa m(x);
    return m.mantissa ? Z(Z(m.mantissa) << (m.exponent - low)) : Z(0);
  }
  template <class Z>
  Corner<Z> corner(const V& x, int low) const {
    return {integer<Z>(x.x, low), integer<Z>(x.y, low), integer<Z>(x.z, low)};
  }
  template <class Z>
  Corner<Z> corner(std::uint32_t vertex) const {
    return corner<Z>(of_.pair_.given(vertex), low_);
  }
  template <class Z>
  Corner<Z> direction() const {
    return corner<Z>(of_.given_, direction_low_);
  }

  template <class Z>
  static Fraction<Z> fraction(const Z& over, const Z& under) {
    return under.sign() < 0 ? Fraction<Z>{-over, -under} : Fraction<Z>{over, under};
  }
  template <class Z>
  static bool less(const Fraction<Z>& x, const Fraction<Z>& y) {
    return x.over * y.under < y.over * x.under;
  }
  // The first component of y that is not zero, and that of x.
  template <class Z>
  static Fraction<Z> ratio(const Corner<Z>& x, const Corner<Z>& y) {
    for (int k = 0; k < 3; ++k)
      if (y[k].sign() != 0) return fraction<Z>(x[k], y[k]);
    return {0, 1};
  }

  // x + t direction is in the plane, or on the line, of the features: n . (b - a) = t n . direction, with a normal n.
  template <class Z>
  Fraction<Z> value(const ContactTime& time) const {
    Corner<Z> a[3], b[3];
    for (int i = 0; i < time.n_a; ++i) a[i] = corner<Z>(time.a[static_cast<std::size_t>(i)]);
    for (int i = 0; i < time.n_b; ++i) b[i] = corner<Z>(time.b[static_cast<std::size_t>(i)]);
    return value<Z>(a, time.n_a, b, time.n_b, direction<Z>());
  }
  template <class Z>
  static Fraction<Z> value(const Corner<Z>* a, int n_a, const Corner<Z>* b, int n_b, const Corner<Z>& d) {
    using exact::cross, exact::dot;
    if (n_a + n_b == 0) return {0, 1};
    const Corner<Z> x = b[0] - a[0];
    if (n_a + n_b == 2) return ratio<Z>(x, d);
    if (n_a + n_b == 3) {
      const Corner<Z> e = n_a == 2 ? a[1] - a[0] : b[1] - b[0];
      return ratio<Z>(cross(x, e), cross(d, e));
    }
    const Corner<Z> n = n_a == 3   ? cross(a[1] - a[0], a[2] - a[0])
                        : n_b == 3 ? cross(b[1] - b[0], b[2] - b[0])
                                   : cross(a[1] - a[0], b[1] - b[0]);
    return fraction<Z>(dot(n, x), dot(n, d));
  }

  int compare(const ContactTime& s, const ContactTime& t) const {
    return with_integers([&]<class Z>(Z) {
      const auto x = value<Z>(s), y = value<Z>(t);
      return less<Z>(x, y) ? -1 : less<Z>(y, x) ? 1 : 0;
    });
  }

  // In units of the scene: the time of the given direction times its length.
  template <class Z>
  double length(const Fraction<Z>& time) const {
    int e_over, e_under;
    const double over = exact::magnitude_of(exact::Big(time.over), e_over),
                 under = exact::magnitude_of(exact::Big(time.under), e_under);
    // The direction, as a double, is `integers` times 2^direction_low: its largest coordinate as a fraction.
    const V d = of_.given_;
    const int top = std::ilogb(std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)}));
    const V unit{std::ldexp(d.x, -top), std::ldexp(d.y, -top), std::ldexp(d.z, -top)};
    const double size = over / under * std::sqrt(dot(unit, unit));
    return (time.over.sign() < 0 ? -1 : 1) * std::ldexp(size, e_over - e_under + low_ - direction_low_ + top);
  }
  double length(const ContactTime& time) const {
    return with_integers([&]<class Z>(Z) { return length<Z>(value<Z>(time)); });
  }

  // The interval of two faces: first and last among the times at which features of both have a point in common along
  // the direction, each by as few vertices as determine it. (A linear program's optimum is at a basic solution.)
  bool interval(const std::array<std::uint32_t, 3>& face_a, const std::array<std::uint32_t, 3>& face_b,
                ContactInterval& found) const {
    return with_integers([&]<class Z>(Z) { return this->interval<Z>(face_a, face_b, found); });
  }

  // See solid/crossing.h: the turn of a face about the line of the direction through a vertex, which counts as moved
  // by INFINITYsimal amounts along two of the axes.
  int turn(std::uint32_t vertex, const std::array<std::uint32_t, 3>& face) const {
    return with_integers([&]<class Z>(Z) {
      using exact::cross, exact::dot;
      const Corner<Z> d = direction<Z>(), v = corner<Z>(vertex);
      const V size{std::fabs(of_.given_.x), std::fabs(of_.given_.y), std::fabs(of_.given_.z)};
      const int longest = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      int turn = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const Corner<Z> p = corner<Z>(face[i]), q = corner<Z>(face[(i + 1) % 3]);
        int s = dot(cross(p - v, q - v), d).sign();
        // The derivative by a move u of the vertex is det(u, p - q, d).
        for (int k = 1; k < 3 && s == 0; ++k) s = cross(p - q, d, (longest + k) % 3).sign();
        if (s == 0 || s == -turn) return 0;
        turn = s;
      }
      return turn;
    });
  }

 private:
  template <class Z>
  bool interval(const std::array<std::uint32_t, 3>& face_a, const std::array<std::uint32_t, 3>& face_b,
                ContactInterval& found) const {
    using exact::cross, exact::dot;
    const Corner<Z> d = direction<Z>();
    Corner<Z> a[3], b[3];
    for (std::size_t i = 0; i < 3; ++i) a[i] = corner<Z>(face_a[i]), b[i] = corner<Z>(face_b[i]);
    int of_a[3][3], of_b[3][3];  // the side of a corner of an edge of the other face, seen along d
    const auto side = [&](const Corner<Z>& x, const Corner<Z>& p, const Corner<Z>& q) {
      return dot(cross(p - x, q - x), d).sign();
    };
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        of_a[i][k] = side(a[i], b[k], b[(k + 1) % 3]);
        of_b[k][i] = side(b[k], a[i], a[(i + 1) % 3]);
      }
    bool any = false;
    Fraction<Z> begin{0, 1}, end{0, 1};
    const auto add = [&](std::initializer_list<int> ia, std::initializer_list<int> ib) {
      ContactTime time;
      Corner<Z> x[3], y[3];
      for (const int i : ia) {
        x[time.n_a] = a[i];
        time.a[static_cast<std::size_t>(time.n_a++)] = face_a[static_cast<std::size_t>(i)];
      }
      for (const int i : ib) {
        y[time.n_b] = b[i];
        time.b[static_cast<std::size_t>(time.n_b++)] = face_b[static_cast<std::size_t>(i)];
      }
      const Fraction<Z> t = value<Z>(x, time.n_a, y, time.n_b, d);
      std::sort(time.a.begin(), time.a.begin() + time.n_a);
      std::sort(time.b.begin(), time.b.begin() + time.n_b);
      if (!any || less<Z>(t, begin)) begin = t, found.begin = time;
      if (!any || less<Z>(end, t)) end = t, found.end = time;
      any = true;
    };
    const auto within = [](const int s[3]) {
      return (s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0);
    };
    const bool flat_a = dot(cross(a[1] - a[0], a[2] - a[0]), d).sign() == 0;
    const bool flat_b = dot(cross(b[1] - b[0], b[2] - b[0]), d).sign() == 0;
    for (int i = 0; i < 3; ++i) {
      if (!flat_b && within(of_a[i])) add({i}, {0, 1, 2});
      if (!flat_a && within(of_b[i])) add({0, 1, 2}, {i});
      for (int k = 0; k < 3; ++k) {
        const int j = (i + 1) % 3, l = (k + 1) % 3;
        if (of_a[i][k] * of_a[j][k] > 0 || of_b[k][i] * of_b[l][i] > 0) continue;
        if (dot(cross(a[j] - a[i], b[l] - b[k]), d).sign() != 0) add({i, j}, {k, l});
      }
    }
    if (flat_a || flat_b) {
      // A point x and an edge p q that appear as a point on a line; those that appear as two points.
      const auto on_edge = [&](const Corner<Z>& x, const Corner<Z>& p, const Corner<Z>& q) {
        const Corner<Z> to = cross(x - p, d), along = cross(q - p, d);
        if (along[0].sign() == 0 && along[1].sign() == 0 && along[2].sign() == 0) return false;
        const Fraction<Z> at = ratio<Z>(to, along);
        return at.over.sign() >= 0 && at.over <= at.under;
      };
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          const int j = (i + 1) % 3, l = (k + 1) % 3;
          if (of_a[i][k] == 0 && on_edge(a[i], b[k], b[l])) add({i}, {k, l});
          if (of_b[k][i] == 0 && on_edge(b[k], a[i], a[j])) add({i, j}, {k});
          const Corner<Z> apart = cross(b[k] - a[i], d);
          if (apart[0].sign() == 0 && apart[1].sign() == 0 && apart[2].sign() == 0) add({i}, {k});
        }
    }
    if (!any) return false;
    for (const auto& [time, t] : {std::pair(&found.begin, &begin), std::pair(&found.end, &end)}) {
      time->at = length<Z>(*t) * of_.pair_.scale();
      time->error = 4e-15 * std::fabs(time->at);
    }
    return true;
  }

  const Translation& of_;
  int low_, direction_low_;
  bool narrow_;
};

Translation::Translation(const MovedPair& pair, const V& direction, const V& from, Decided decided)
    : pair_(pair), given_(direction), from_(from), exact_(decided == Decided::exactly) {
  const double largest = max_norm(direction);
  const int top = std::ilogb(largest);
  V d{std::ldexp(direction.x, -top), std::ldexp(direction.y, -top), std::ldexp(direction.z, -top)};
  d = (1 / std::sqrt(dot(d, d))) * d;
  const V size{std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)};
  const V across = size.x <= size.y && size.x <= size.z ? V{1, 0, 0} : size.y <= size.z ? V{0, 1, 0} : V{0, 0, 1};
  V u = cross(across, d);
  u = (1 / std::sqrt(dot(u, u))) * u;
  axis_[0] = u, axis_[1] = cross(d, u), axis_[2] = d;
  per_axis_ = {1 / d.x, 1 / d.y, 1 / d.z};
}

int Translation::compare(const ContactTime& s, const ContactTime& t) const {
  if (s.at + s.error < t.at - t.error) return -1;
  if (s.at - s.error > t.at + t.error) return 1;
  if (s.same_features(t)) return 0;
  return exact_ ? Exact(*this).compare(s, t) : sign_of(s.at - t.at);
}

double Translation::length(const ContactTime& time) const { return Exact(*this).length(time); }

// The times, if any, at which a point of one box, moved, is a point of the other.
bool Translation::meeting(const BoxedMesh::Box& a, const BoxedMesh::Box& b, Range& range) const {
  const auto along = [&](double low, double high, double d, double per) {  // low <= s d <= high
    low -= frame_error, high += frame_error;
    if (d == 0) return low <= 0 && high >= 0;
    // A rounded coordinate of the direction is off by 4 u, and a product with its inverse by 2 u more, times 4 at most.
    const double s = low * per, t = high * per;
    range.low = std::max(range.low, std::min(s, t)), range.high = std::min(range.high, std::max(s, t));
    return range.low <= range.high;
  };
  const V& d = axis_[2];
  const V low = b.low - a.high - from_, high = b.high - a.low - from_;
  return along(low.x, high.x, d.x, per_axis_.x) && along(low.y, high.y, d.y, per_axis_.y) &&
         along(low.z, high.z, d.z, per_axis_.z);
}

Translation::FaceInFrame Translation::in_frame(const std::array<std::uint32_t, 3>& face, bool moves) const {
  FaceInFrame f;
  for (std::size_t i = 0; i < 3; ++i) {
    const V x = moves ? pair_.position(face[i]) + from_ : pair_.position(face[i]);
    f.u[i] = dot(axis_[0], x), f.v[i] = dot(axis_[1], x), f.w[i] = dot(axis_[2], x);
  }
  const double* all[] = {f.u, f.v, f.w};
  for (int k = 0; k < 3; ++k) {
    f.low[k] = std::min(std::min(all[k][0], all[k][1]), all[k][2]);
    f.high[k] = std::max(std::max(all[k][0], all[k][1]), all[k][2]);
  }
  return f;
}

// Whether the boxes of faces or leaves are, across the direction.
template <class A, class B>
bool Translation::apart(const A& a, const B& b) {
  return a.low[0] > b.high[0] + 2 * frame_error || b.low[0] > a.high[0] + 2 * frame_error ||
         a.low[1] > b.high[1] + 2 * frame_error || b.low[1] > a.high[1] + 2 * frame_error;
}

// In the plane of u and v, where the faces are triangles that rest: times are differences of w over the points that
// they have in common, first and last at corners of one or where edges cross.
//
// Bounds: an orientation from differences that are off by 2 `frame_error` each, and at most D, is off by E = 16
// frame_error D + 64 frame_error^2, rounding included. A weight x / (x - y) of two orientations of opposite signs is
// off by 8 E / |x - y|, and so is a height, times the range of heights.
Translation::Found Translation::interval(const FaceInFrame& a, const FaceInFrame& b,
                                         const std::array<std::uint32_t, 3>& face_a,
                                         const std::array<std::uint32_t, 3>& face_b, ContactInterval& found) const {
  const auto least = [](const double* x) { return std::min(std::min(x[0], x[1]), x[2]); };
  const auto most = [](const double* x) { return std::max(std::max(x[0], x[1]), x[2]); };
  if (apart(a, b)) return Found::no;
  const double d = std::max(a.high[0], b.high[0]) - std::min(a.low[0], b.low[0]) + std::max(a.high[1], b.high[1]) -
                   std::min(a.low[1], b.low[1]);
  const double e = 16 * frame_error * d + 64 * frame_error * frame_error;
  double of_a[3][3], of_b[3][3];
  const auto orient = [](const FaceInFrame& x, int i, const FaceInFrame& f, int k) {
    const int l = (k + 1) % 3;
    return (f.u[k] - x.u[i]) * (f.v[l] - x.v[i]) - (f.v[k] - x.v[i]) * (f.u[l] - x.u[i]);
  };
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) of_a[i][k] = orient(a, i, b, k), of_b[k][i] = orient(b, k, a, i);
  const double area_a = of_b[0][0] + of_b[0][1] + of_b[0][2], area_b = of_a[0][0] + of_a[0][1] + of_a[0][2];
  // All of one beyond an edge of the other: corners of the latter have orientations 0, 0 and its area.
  const auto beyond_edge = [&](const double of[3][3], double area) {
    for (int k = 0; k < 3; ++k) {
      const double x[3] = {of[0][k], of[1][k], of[2][k]};
      if (least(x) - e > std::max(0.0, area + 3 * e) || most(x) + e < std::min(0.0, area - 3 * e)) return true;
    }
    return false;
  };
  if (beyond_edge(of_a, area_b) || beyond_edge(of_b, area_a)) return Found::no;

  bool certain = true;
  std::array<std::pair<double, double>, 15> all;  // times and errors
  std::size_t n = 0;
  const auto add = [&](double at, double error, std::initializer_list<int> ia, std::initializer_list<int> ib) {
    ContactTime time;
    time.at = at, time.error = error + 4 * frame_error;
    all[n++] = {time.at, time.error};
    for (const int i : ia) time.a[static_cast<std::size_t>(time.n_a++)] = face_a[static_cast<std::size_t>(i)];
    for (const int i : ib) time.b[static_cast<std::size_t>(time.n_b++)] = face_b[static_cast<std::size_t>(i)];
    if (n == 1 || at < found.begin.at) found.begin = time;
    if (n == 1 || at > found.end.at) found.end = time;
  };
  const auto corner = [&](const double of[3], double area, const FaceInFrame& f, double height, auto&& use) {
    const double s = area > 0 ? 1 : -1;
    if (s * of[0] < -e || s * of[1] < -e || s * of[2] < -e) return;
    if (s * area <= 24 * e) {
      certain = false;
      return;
    }
    certain &= s * of[0] > e && s * of[1] > e && s * of[2] > e;
    const double at = (of[0] * f.w[2] + of[1] * f.w[0] + of[2] * f.w[1]) / area;
    use(at - height, 16 * e * (f.high[2] - f.low[2]) / (s * area));
  };
  for (int i = 0; i < 3; ++i) {
    corner(of_a[i], area_b, b, a.w[i], [&](double at, double error) { add(at, error, {i}, {0, 1, 2}); });
    corner(of_b[i], area_a, a, b.w[i], [&](double at, double error) { add(-at, error, {0, 1, 2}, {i}); });
    for (int k = 0; k < 3; ++k) {
      const int j = (i + 1) % 3, l = (k + 1) % 3;
      const double x = of_a[i][k], y = of_a[j][k], p = of_b[k][i], q = of_b[l][i];
      if ((x > e && y > e) || (x < -e && y < -e) || (p > e && q > e) || (p < -e && q < -e)) continue;
      certain &= std::fabs(x) > e && std::fabs(y) > e && std::fabs(p) > e && std::fabs(q) > e;
      if (std::fabs(x - y) <= 24 * e || std::fabs(p - q) <= 24 * e) {
        certain = false;
        continue;
      }
      const double in_a = a.w[i] + x / (x - y) * (a.w[j] - a.w[i]), in_b = b.w[k] + p / (p - q) * (b.w[l] - b.w[k]);
      add(in_b - in_a, 8 * e * (std::fabs((a.w[j] - a.w[i]) / (x - y)) + std::fabs((b.w[l] - b.w[k]) / (p - q))),
          {i, j}, {k, l});
    }
  }
  if (n == 0) return certain ? Found::no : Found::unsure;
  // The first and the last one must be known.
  const auto near = [&](const ContactTime& time) {
    return std::count_if(all.begin(), all.begin() + n, [&](const auto& other) {
      return std::fabs(other.first - time.at) <= other.second + time.error;
    });
  };
  certain = certain && near(found.begin) == 1 && near(found.end) == 1;
  for (ContactTime* time : {&found.begin, &found.end}) {
    std::sort(time->a.begin(), time->a.begin() + time->n_a);
    std::sort(time->b.begin(), time->b.begin() + time->n_b);
  }
  return certain ? Found::yes : Found::unsure;
}

bool Translation::times(const FaceInFrame& a, const FaceInFrame& b, const std::array<std::uint32_t, 3>& face_a,
                        const std::array<std::uint32_t, 3>& face_b, ContactInterval& found) const {
  const Found is = interval(a, b, face_a, face_b, found);
  if (is != Found::unsure) return is == Found::yes;
  if (exact_) return Exact(*this).interval(face_a, face_b, found);
  return found.begin.n_a + found.begin.n_b > 0;
}

// Leaves of one mesh in the frame, each when it is first needed.
class Translation::LeavesInFrame {
 public:
  LeavesInFrame(const Translation& translation, const BoxedMesh& mesh, bool moves)
      : translation_(translation), mesh_(mesh), moves_(moves), number_(mesh.nodes.size()) {}
  const LeafInFrame& operator[](std::uint32_t node) {
    if (number_[node]) return leaves_[number_[node] - 1];
    LeafInFrame& leaf = leaves_.emplace_back();
    number_[node] = static_cast<std::uint32_t>(leaves_.size());
    std::ranges::fill(leaf.low, INFINITY), std::ranges::fill(leaf.high, -INFINITY);
    const BoxedMesh::Node& of = mesh_.nodes[node];
    for (std::uint32_t i = of.first_face; i < of.end_face; ++i) {
      const FaceInFrame& face = leaf.faces[i - of.first_face] = translation_.in_frame(mesh_.faces[i], moves_);
      for (int k = 0; k < 3; ++k)
        leaf.low[k] = std::min(leaf.low[k], face.low[k]), leaf.high[k] = std::max(leaf.high[k], face.high[k]);
    }
    return leaf;
  }

 private:
  const Translation& translation_;
  const BoxedMesh& mesh_;
  bool moves_;
  std::vector<std::uint32_t> number_;  // plus 1
  std::deque<LeafInFrame> leaves_;
};

// Best first, by bounds from boxes.
template <bool latest, class Accept>
std::optional<ContactTime> Translation::search(double after, double before, double enough, Accept&& accept) const {
  struct Entry {
    double key;
    std::uint32_t a, b;
    bool operator<(const Entry& other) const { return key < other.key; }
  };
  const BoxedMesh &mesh_a = pair_.a(), &mesh_b = pair_.b();
  std::vector<Entry> heap;
  std::optional<ContactTime> best;
  double bound = -INFINITY;  // of keys
  const auto push = [&](std::uint32_t a, std::uint32_t b) {
    Range range{-INFINITY, INFINITY};
    if (!meeting(mesh_a.nodes[a].box, mesh_b.nodes[b].box, range) || range.high < after || range.low > before) return;
    const double key = latest ? range.high : -std::max(range.low, after);
    if (key < bound) return;
    heap.push_back({key, a, b});
    std::push_heap(heap.begin(), heap.end());
  };
  const auto extent = [](const BoxedMesh::Box& box) {
    const V d = box.high - box.low;
    return d.x + d.y + d.z;
  };
  push(0, 0);
  LeavesInFrame leaves_a(*this, mesh_a, true), leaves_b(*this, mesh_b, false);
  std::uint32_t steps = 0;
  while (!heap.empty() && heap.front().key >= bound) {
    if (++steps % 256 == 0) pair_.heed();
    const Entry top = heap.front();
    std::pop_heap(heap.begin(), heap.end());
    heap.pop_back();
    const BoxedMesh::Node &a = mesh_a.nodes[top.a], &b = mesh_b.nodes[top.b];
    if (a.children && (!b.children || extent(a.box) >= extent(b.box))) {
      push(a.children, top.b), push(a.children + 1, top.b);
      continue;
    }
    if (b.children) {
      push(top.a, b.children), push(top.a, b.children + 1);
      continue;
    }
    const LeafInFrame &of_a = leaves_a[top.a], &of_b = leaves_b[top.b];
    const auto out_of_question = [&](const auto& x, const auto& y) {
      const double low = y.low[2] - x.high[2] - 4 * frame_error, high = y.high[2] - x.low[2] + 4 * frame_error;
      return high < after || low > before || (latest ? high : -low) < bound || apart(x, y);
    };
    if (out_of_question(of_a, of_b)) continue;
    for (std::uint32_t i = 0; i < a.end_face - a.first_face; ++i) {
      const FaceInFrame& x = of_a.faces[i];
      if (out_of_question(x, of_b)) continue;
      for (std::uint32_t k = 0; k < b.end_face - b.first_face; ++k) {
        const FaceInFrame& y = of_b.faces[k];
        if (out_of_question(x, y)) continue;
        ContactInterval found;
        if (!times(x, y, mesh_a.faces[a.first_face + i], mesh_b.faces[b.first_face + k], found)) continue;
        const ContactTime& time = latest ? found.end : found.begin;
        if ((latest ? time.at : -time.at) + time.error < bound || !accept(found)) continue;
        if (best && (latest ? compare(*best, time) : compare(time, *best)) >= 0) continue;
        best = time;
        bound = (latest ? time.at : -time.at) - time.error;
        if (bound > enough) return best;
      }
    }
  }
  return best;
}

std::optional<ContactTime> Translation::latest_end(const ContactTime* containing, double enough) const {
  if (!containing) return search<true>(-INFINITY, INFINITY, enough, [](const ContactInterval&) { return true; });
  const double low = containing->at - containing->error, high = containing->at + containing->error;
  return search<true>(low, high, enough, [&](const ContactInterval& i) {
    return compare(i.begin, *containing) <= 0 && compare(i.end, *containing) >= 0;
  });
}

std::optional<ContactTime> Translation::earliest_begin(const ContactTime& after, double before) const {
  return search<false>(after.at - after.error, before, INFINITY,
                       [&](const ContactInterval& i) { return compare(i.begin, after) > 0; });
}

bool Translation::contained_after(const ContactTime& time) const {
  const auto any_inside = [&](const BoxedMesh& inner, const BoxedMesh& outer, bool of_a) {
    return outer.topology->closed && std::ranges::any_of(inner.topology->representatives, [&](std::uint32_t vertex) {
             return winding_after(vertex, of_a, time) != 0;
           });
  };
  return any_inside(pair_.a(), pair_.b(), true) || any_inside(pair_.b(), pair_.a(), false);
}

// By the crossings with the outer mesh, from the last one backwards.
void Translation::inside_during(std::uint32_t vertex, bool of_a, std::vector<Range>& found) const {
  const BoxedMesh& outer = of_a ? pair_.b() : pair_.a();
  if (!outer.topology->closed) return;
  const V x = pair_.position(vertex);
  const BoxedMesh::Box point{x, x};
  const FaceInFrame here = in_frame({vertex, vertex, vertex}, of_a);
  std::vector<std::pair<double, int>> crossings;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const BoxedMesh::Node& node = outer.nodes[stack.back()];
    stack.pop_back();
    Range range{0, INFINITY};
    if (!(of_a ? meeting(point, node.box, range) : meeting(node.box, point, range))) continue;
    if (node.children) stack.push_back(node.children + 1), stack.push_back(node.children);
    for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
      const FaceInFrame f = in_frame(outer.faces[i], !of_a);
      if (apart(f, here)) continue;
      double of[3];
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        of[k] = (f.u[k] - here.u[0]) * (f.v[l] - here.v[0]) - (f.v[k] - here.v[0]) * (f.u[l] - here.u[0]);
        if (std::fabs(of[k]) <= 64 * frame_error * (f.high[0] - f.low[0] + f.high[1] - f.low[1])) return;  // uncertain
      }
      const int turn = sign_of(of[0]);
      if (sign_of(of[1]) != turn || sign_of(of[2]) != turn) continue;
      const double height = (of[0] * f.w[2] + of[1] * f.w[0] + of[2] * f.w[1]) / (of[0] + of[1] + of[2]) - here.w[0];
      crossings.emplace_back(of_a ? height : -height, turn);
    }
  }
  std::ranges::sort(crossings);
  int winding = 0;
  for (std::size_t i = crossings.size(); i-- > 0 && crossings[i].first > 0;) {
    winding += crossings[i].second;
    if (winding != 0) found.push_back({i ? std::max(0.0, crossings[i - 1].first) : 0.0, crossings[i].first});
  }
}

// The faces that the vertex, on its way relative to the other mesh, meets later, with their orientation.
int Translation::winding_after(std::uint32_t vertex, bool of_a, const ContactTime& time) const {
  const BoxedMesh& outer = of_a ? pair_.b() : pair_.a();
  const V x = pair_.position(vertex);
  const BoxedMesh::Box point{x, x};
  const std::array<std::uint32_t, 3> thrice{vertex, vertex, vertex};
  const FaceInFrame here = in_frame(thrice, of_a);
  int winding = 0;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const BoxedMesh::Node& node = outer.nodes[stack.back()];
    stack.pop_back();
    Range range{time.at - time.error, INFINITY};
    if (!(of_a ? meeting(point, node.box, range) : meeting(node.box, point, range))) continue;
    if (node.children) stack.push_back(node.children + 1), stack.push_back(node.children);
    for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
      const auto& face = outer.faces[i];
      const FaceInFrame f = in_frame(face, !of_a);
      const double size = [&] {
        double d = 0;
        for (int k = 0; k < 3; ++k) d = std::max({d, std::fabs(f.u[k] - here.u[0]), std::fabs(f.v[k] - here.v[0])});
        return 4 * d;
      }();
      const double e = 16 * frame_error * size + 64 * frame_error * frame_error;
      int turn = 0;
      bool certain = true, crosses = true;
      double of[3];
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        of[k] = (f.u[k] - here.u[0]) * (f.v[l] - here.v[0]) - (f.v[k] - here.v[0]) * (f.u[l] - here.u[0]);
        if (std::fabs(of[k]) <= e) {
          certain = false;
          continue;
        }
        const int s = sign_of(of[k]);
        crosses &= s != -turn;
        turn = s;
      }
      if (!crosses) continue;
      if (!certain) turn = Exact(*this).turn(vertex, face);
      if (turn == 0) continue;
      ContactTime at;
      std::array<std::uint32_t, 3> sorted = face;
      std::ranges::sort(sorted);
      if (of_a)
        at.n_a = 1, at.n_b = 3, at.a = {vertex, 0, 0}, at.b = sorted;
      else
        at.n_a = 3, at.n_b = 1, at.a = sorted, at.b = {vertex, 0, 0};
      const double area = of[0] + of[1] + of[2];
      if (std::fabs(area) > 24 * e && certain) {
        const double height = (of[0] * f.w[2] + of[1] * f.w[0] + of[2] * f.w[1]) / area - here.w[0];
        at.at = of_a ? height : -height;
        at.error = 4 * frame_error + 16 * e * (f.high[2] - f.low[2]) / std::fabs(area);
      } else {
        at.at = length(at) * pair_.scale(), at.error = 4e-15 * std::fabs(at.at);
      }
      if (compare(at, time) > 0) winding += turn;
    }
  }
  return winding;
}

}  // namespace hpccd
