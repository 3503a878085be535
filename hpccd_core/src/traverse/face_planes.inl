// SPDX-License-Identifier: Apache-2.0
// On which sides of the planes of a leaf's faces the corners of another leaf lie, in a snapshot. Most pairs of leaves
// are neighbours in a mesh, so their boxes overlap; but where the surface is curved, most edges are on one side of the
// planes. Part of leaf_edge_faces.inl.

#include "traverse/corners_against.inl"

// Error bounds of the heights of two leaves' corners above the planes of their faces. X is the largest extent of the
// box of both. Coordinates, at most 2.25, have an error of r = 2^-23 and less than 1e-15 more; half an ulp of 1 is r
// / 2. A difference of two has an error of at most 2 r + X r / 2, and a coordinate of a face's normal, which is two
// products of two differences, one of 8 r X + 4 r X^2 + r^2 (8 + 4 X + ...) < e = 9 r (X + r) (1 + X / 2).
//
// The height of x above the plane through p is n x - n p. With N = |n.x| + |n.y| + |n.z|, each product has an error of
// at most 3 r / 2 * 2.25 N, their comparison one of 1.2 r N, the coordinates of x and p contribute 2 r N, and the error
// of n contributes 3 X e. The sum is less than 10 r N + 27 r X (X + r) (1 + X / 2).
struct PlaneErrors {
  bool known;  // otherwise there are no planes: coordinates of boxes have grown or are bent
  float of_coordinates, of_normals;

  HPCCD_HD PlaneErrors(const Tree& tree, const Node& a, const Node& b) : known(!tree.grown && !tree.bent) {
    constexpr float r = 1.2e-7f;
    float size = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const float low = lesser(a.box.t0.low[k], b.box.t0.low[k]), high = greater(a.box.t0.high[k], b.box.t0.high[k]);
      size = greater(size, high - low);
    }
    of_coordinates = 12 * r;
    of_normals = 28 * r * size * (size + r) * (1 + size);
  }
};

struct FacePlane {
  float n[3], at;  // twice the area long; n x == at for the points of the face
  float least;     // the error of a height: beyond it the sign is certain

  template <class Leaf>
  HPCCD_HD static FacePlane of(const LeafFeatures& leaf, std::uint32_t face, const PlaneErrors& errors) {
    const auto& corner = leaf.corners_of->face;
    Vec3<float> x[3];
    for (int j = 0; j < 3; ++j) {
      const auto box = Leaf::box_of(leaf, corner[j][face]);
      x[j] = {box[low(0, 0)], box[low(0, 1)], box[low(0, 2)]};
    }
    const Vec3<float> n = cross(x[1] - x[0], x[2] - x[0]);
    const float sum = magnitude(n.x) + magnitude(n.y) + magnitude(n.z);
    return {{n.x, n.y, n.z}, dot(n, x[0]), errors.of_coordinates * sum + errors.of_normals};
  }
};

// The sides of a plane on which corners of a leaf certainly lie.
template <class Leaf>
struct PlaneSides : Leaf::template Sides<1> {
  HPCCD_HD PlaneSides(const FacePlane& plane, const LeafFeatures& leaf) {
    const Row above = all_lanes(plane.at + plane.least), below = all_lanes(plane.at - plane.least);
    this->find(leaf, [&](std::uint32_t group, std::uint32_t lane, RowMask(&beyond)[6]) {
      const CornerRow* rows = leaf.rows + group * Leaf::next_group;
      const auto along = [&](std::uint32_t axis) {
        return all_lanes(plane.n[axis]) * load_row(rows[axis].lane + lane);
      };
      const Row height = along(0) + along(1) + along(2);
      beyond[0] = less(above, height), beyond[1] = less(height, below);
    });
  }
};
