// SPDX-License-Identifier: Apache-2.0
// Results are bit-identical on every processor. Each constant below is the hash of the whole result of a query on
// x86-64, for every instruction set and number of threads. A changed constant means that results have changed:
// CHANGELOG.rst must report it, and an unintended change is a bug. A failure prints the hash that was found; to
// regenerate the constants, replace them with the printed ones.
//
// Coordinates come of whole numbers, by operations that IEEE 754 rounds in one way only: no sine, none of the standard
// library's distributions.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <iomanip>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "base/simd.h"
#include "grid_scene.h"
#include "hpccd/hpccd.h"
#include "rope_scene.h"
#include "soup_scene.h"
#include "swarm_scene.h"

namespace hpccd {
namespace {

// Reals in [-1, 1), multiples of 2^-52.
class Random {
 public:
  explicit Random(std::uint64_t seed) : numbers_(seed) {}
  double real() { return static_cast<double>(numbers_() >> 11) * 0x1p-52 - 1; }
  double whole(std::uint64_t end) { return static_cast<double>(numbers_() % end); }  // below `end`

 private:
  std::mt19937_64 numbers_;
};

struct Motion {
  const char* name;
  std::shared_ptr<const Scene> scene;
  std::vector<double> start, end;
};

// One sheet in folds, whose layers are pressed through each other.
Motion folded() {
  constexpr std::uint32_t side = 20, fold = 4;
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("sheet", test::sheet_faces(side), side * side, {});
  Motion m{"folded", std::move(scene), {}, {}};
  Random random(1);
  for (auto [positions, gap] : {std::pair{&m.start, 0.3}, std::pair{&m.end, 0.01}})
    for (std::uint32_t i = 0; i < side * side; ++i) {
      const std::uint32_t row = i / side, column = i % side, turn = row % (2 * fold);
      const double height = turn <= fold ? turn : 2 * fold - turn;
      positions->insert(positions->end(), {0.5 * column + 0.1 * random.real(), gap * row + 0.15 * random.real(),
                                           0.5 * height + 0.1 * random.real()});
    }
  return m;
}

// A rough sheet that falls through another one; apart at the start.
Motion falling() {
  constexpr std::uint32_t side = 15;
  Motion m{"falling", test::two_sheets(side, 3), {}, {}};
  Random random(2);
  for (auto [positions, height] : {std::pair{&m.start, 0.7}, std::pair{&m.end, -0.05}})
    for (std::uint32_t sheet = 0; sheet < test::sheets; ++sheet) {
      for (std::uint32_t i = 0; i < side * side; ++i)
        positions->insert(positions->end(),
                          {i % side + 0.31 * sheet + 0.1 * random.real(), i / side + 0.17 * sheet + 0.1 * random.real(),
                           height * sheet + 0.2 * random.real()});
      for (std::uint32_t i = 0; i < 3; ++i) positions->insert(positions->end(), {0.37 + i, 0.41 + i, height});
    }
  return m;
}

// Vertices in threes near to each other.
Motion tossed(const char* name, std::shared_ptr<const Scene> scene, std::uint64_t seed) {
  Motion m{name, std::move(scene), {}, {}};
  Random random(seed);
  for (std::uint32_t triangle = 0; triangle < m.scene->n_vertices() / 3; ++triangle) {
    const double center[3] = {2 * random.real(), 2 * random.real(), 0.5 * random.real()};
    for (int i = 0; i < 9; ++i) {
      m.start.push_back(center[i % 3] + 0.5 * random.real());
      m.end.push_back(m.start.back() + 0.2 * random.real());
    }
  }
  return m;
}

Motion soup() { return tossed("soup", test::soup_scene(100), 3); }

// All rules of pairs of meshes, vertices in no triangle, static meshes.
Motion swarm() { return {"swarm", test::swarm_scene(true), test::swarm_positions(1), test::swarm_positions(2)}; }

// Whole numbers below nine: contacts at the very start and end, at the same time, in the same place; parallel and
// coplanar features, triangles without area.
Motion whole_numbers() {
  constexpr std::uint32_t n = 45;
  Motion m{"whole numbers", test::soup_scene(n), {}, {}};
  Random random(4);
  for (std::uint32_t triangle = 0; triangle < 2 * n; ++triangle) {
    const double center[3] = {random.whole(6), random.whole(6), random.whole(4)};
    for (int i = 0; i < 9; ++i) {
      m.start.push_back(center[i % 3] + random.whole(3));
      m.end.push_back(m.start.back() + random.whole(3) - 1);
    }
  }
  return m;
}

// Edges in no triangle.
Motion ropes() { return tossed("ropes", test::rope_scene(210), 6); }

constexpr std::size_t n_motions = 6, n_tiers = 4;
const std::array<Motion, n_motions>& motions() {
  static const std::array<Motion, n_motions> all{folded(), falling(), soup(), swarm(), whole_numbers(), ropes()};
  return all;
}

class Hash {
 public:
  std::uint64_t value() const { return h_; }
  void add(std::uint64_t x) {
    h_ = (h_ ^ x) * 0x9E3779B97F4A7C15u;
    h_ ^= h_ >> 32;
  }
  void add(std::uint32_t x) { add(std::uint64_t{x}); }
  void add(bool x) { add(std::uint64_t{x}); }
  void add(double x) { add(std::bit_cast<std::uint64_t>(x)); }
  template <class T, std::size_t n>
  void add(const std::array<T, n>& list) {
    for (const T& x : list) add(x);
  }
  template <class T>
  void add(const std::vector<T>& list) {
    add(std::uint64_t{list.size()});
    for (const T& x : list) add(x);
  }
  void add(const WorldSlices& s) { add_all(s.vf, s.ee, s.ef, s.hashes); }
  void add(const Contacts& c) {
    add_all(c.vf, c.vf_toc, c.ee, c.ee_toc, c.points, c.normals, c.closest, c.first_toc, c.hash, c.slices,
            c.first_tocs);
  }
  void add(const Proximity& p) { add_all(p.vf, p.vf_distance, p.ee, p.ee_distance, p.closest, p.hash, p.slices); }
  void add(const Intersections& i) { add_all(i.ef, i.hash, i.slices); }
  void add(const Gap& g) {
    add_all(g.mesh_a, g.mesh_b, g.distance, static_cast<std::uint32_t>(g.kind), g.features, g.points);
  }

 private:
  template <class... Parts>
  void add_all(const Parts&... parts) {
    (add(parts), ...);
  }
  std::uint64_t h_ = 1;
};

std::string as_constant(std::uint64_t x) {
  std::ostringstream text;
  text << "0x" << std::hex << std::uppercase << std::setfill('0') << std::setw(16) << x << "u";
  return text.str();
}

using Golden = std::array<std::array<std::uint64_t, n_tiers>, n_motions>;  // by scene and accuracy

// ask(detector, motion, hash): of a detector with these options, on each instruction set.
template <class Ask>
void expect(std::uint64_t golden, const Motion& motion, Options options, Ask&& ask) {
  options.backend = Backend::cpu;
  for (const Simd simd : simd_levels())
    for (const int threads : {1, 3}) {
      options.simd = simd, options.threads = threads;
      Detector detector(motion.scene, options);
      Hash hash;
      ask(detector, motion, hash);
      EXPECT_EQ(as_constant(hash.value()), as_constant(golden))
          << motion.name << ", accuracy " << static_cast<int>(options.accuracy) << ", " << name_of(simd) << ", threads "
          << threads;
    }
}

using Golden = std::array<std::array<std::uint64_t, n_tiers>, n_motions>;  // by scene and accuracy

template <class Ask>
void expect(const Golden& golden, Options options, Ask&& ask) {
  for (std::size_t m = 0; m < n_motions; ++m)
    for (std::size_t tier = 0; tier < n_tiers; ++tier) {
      options.accuracy = static_cast<Accuracy>(tier);
      expect(golden[m][tier], motions()[m], options, ask);
    }
}

void detect(Detector& detector, const Motion& m, Hash& hash) {
  hash.add(detector.detect(test::view(m.start), test::view(m.end)));
}

TEST(GoldenHashes, ScenesAreRich) {
  for (const Motion& m : motions()) {
    Detector detector(m.scene, {.backend = Backend::cpu, .threads = 1});
    const Contacts contacts = detector.detect(test::view(m.start), test::view(m.end));
    EXPECT_GT(contacts.vf.size(), 80u) << m.name;
    EXPECT_GT(contacts.ee.size(), 300u) << m.name;
    EXPECT_GT(detector.intersections(test::view(m.end)).ef.size(), 100u) << m.name;
    EXPECT_GT(detector.proximity(test::view(m.end), 0.1).ee.size(), 50u) << m.name;
  }
}

TEST(GoldenHashes, Contacts) {
  constexpr Golden golden{{{0xBB153E270D3E3990u, 0x35EF10B60C775BFEu, 0xCBA48862670F8EDDu, 0x9EAD80B438D83FFFu},
                           {0x1CFBD55364A551F3u, 0xE87B410231C2B118u, 0xB5D8070206E30A0Bu, 0xE87B410231C2B118u},
                           {0xAFAF9A08329A9F91u, 0xF9617E5E16409B13u, 0x714BA7F7073CC8A3u, 0x4E336F6189D49319u},
                           {0x956235E3B196E6FAu, 0xC458088BA62C08CDu, 0x28C29FE1A1A7D200u, 0x9F5ECA1EA767241Bu},
                           {0x1EB486AD707B4393u, 0x9699C2204C905A12u, 0xCBACDA2540311AE7u, 0xF8EC0D5BB72DA276u},
                           {0x37881D31CF6F0D8Fu, 0x723661FCA7780535u, 0x0CC7A9EB96C832DBu, 0x151DC8F22C935B50u}}};
  expect(golden, {.points = true, .normals = true, .closest = true}, detect);
}

TEST(GoldenHashes, FirstContacts) {
  constexpr Golden golden{{{0x5E4463E44475B010u, 0x6CCD4027FF1BC329u, 0x8C19FF10ADB8BA67u, 0x6CCD4027FF1BC329u},
                           {0xAC7A9F74E05779B0u, 0xFE8519B145482FBBu, 0xE6384692754811B2u, 0xFE8519B145482FBBu},
                           {0x5BCCE047EE9480F5u, 0x8E3200053C6746F3u, 0x7170B82FDA2A8CE7u, 0x8E3200053C6746F3u},
                           {0xA32A6C41EBD83F00u, 0xA32A6C41EBD83F00u, 0xA32A6C41EBD83F00u, 0xA32A6C41EBD83F00u},
                           {0x22099A87BB53F3FBu, 0x22099A87BB53F3FBu, 0x22099A87BB53F3FBu, 0x22099A87BB53F3FBu},
                           {0x26141BB2A46B9888u, 0xC3253983979C0AABu, 0x2AE8FF23CBF522E8u, 0xC3253983979C0AABu}}};
  expect(golden, {.report = Report::first, .points = true, .normals = true, .closest = true}, detect);
}

TEST(GoldenHashes, ContactsWithASeparation) {
  constexpr Golden golden{{{0x7556DD019F83F1F0u, 0x7556DD019F83F1F0u, 0x7556DD019F83F1F0u, 0x7556DD019F83F1F0u},
                           {0xACD16411A772FC94u, 0xACD16411A772FC94u, 0xACD16411A772FC94u, 0xACD16411A772FC94u},
                           {0xCB1FAD5385B0E696u, 0xCB1FAD5385B0E696u, 0xCB1FAD5385B0E696u, 0xCB1FAD5385B0E696u},
                           {0x45952E7E4AAB18A0u, 0x45952E7E4AAB18A0u, 0x45952E7E4AAB18A0u, 0x45952E7E4AAB18A0u},
                           {0x22C09B7BB55CD097u, 0x22C09B7BB55CD097u, 0x22C09B7BB55CD097u, 0x22C09B7BB55CD097u},
                           {0x0C3B70B7A98B0669u, 0x0C3B70B7A98B0669u, 0x0C3B70B7A98B0669u, 0x0C3B70B7A98B0669u}}};
  expect(golden, {.points = true, .normals = true, .closest = true, .minimum_separation = 0.03}, detect);
}

TEST(GoldenHashes, FirstContactsWithASeparation) {
  constexpr Golden golden{{{0x089FA108D422E594u, 0x089FA108D422E594u, 0x089FA108D422E594u, 0x089FA108D422E594u},
                           {0x175A2302C6AFC4BCu, 0x175A2302C6AFC4BCu, 0x175A2302C6AFC4BCu, 0x175A2302C6AFC4BCu},
                           {0xDC18EA19E074B447u, 0xDC18EA19E074B447u, 0xDC18EA19E074B447u, 0xDC18EA19E074B447u},
                           {0x139B9E642C424A76u, 0x139B9E642C424A76u, 0x139B9E642C424A76u, 0x139B9E642C424A76u},
                           {0x6E43A389A489E0AAu, 0x6E43A389A489E0AAu, 0x6E43A389A489E0AAu, 0x6E43A389A489E0AAu},
                           {0x63D273F02D50CF24u, 0x63D273F02D50CF24u, 0x63D273F02D50CF24u, 0x63D273F02D50CF24u}}};
  expect(golden, {.report = Report::first, .minimum_separation = 0.03}, detect);
}

// Found in other ways: the same contacts.
TEST(GoldenHashes, ContactsByPublishedMethods) {
  constexpr std::array<std::uint64_t, n_motions> golden{0x6E41C34E96A5030Au, 0x9D590560620DB588u, 0x7B265FF390BE7098u,
                                                        0x737896F5976FEAA1u, 0xDD5AB5BBA8EDEF99u, 0xE6D2304740F4E48Du};
  for (const Method method : {Method::standard, Method::published, Method::naive, Method::front})
    for (std::size_t m = 0; m < n_motions; ++m) expect(golden[m], motions()[m], {.method = method}, detect);
}

TEST(GoldenHashes, CollisionFreeSteps) {
  constexpr Golden golden{{{0xC1EE51AAF7876A43u, 0xCC803DD870163A3Du, 0x761C3AE0BFA4AE9Bu, 0x761C3AE0BFA4AE9Bu},
                           {0xCF2AF208797AE009u, 0xD6DEA2B998853992u, 0xFC1CB1C56D5D5805u, 0xFC1CB1C56D5D5805u},
                           {0x17B21FEF27343087u, 0xA7F1093FBF15E813u, 0xC797EF8F43D7E5BEu, 0xC797EF8F43D7E5BEu},
                           {0x6B54881EF303A3FAu, 0xE777B95D7A381F29u, 0xF53D76E72F1C5970u, 0xF53D76E72F1C5970u},
                           {0xAB169EB8AEAE59A4u, 0xAB169EB8AEAE59A4u, 0xAB169EB8AEAE59A4u, 0xAB169EB8AEAE59A4u},
                           {0xAEC5C28B04371F43u, 0xF6A8B585C10D00DDu, 0xE2DA2935D6F85B05u, 0xE2DA2935D6F85B05u}}};
  expect(golden, {}, [](Detector& detector, const Motion& m, Hash& hash) {
    hash.add(detector.collision_free_step(test::view(m.start), test::view(m.end)));
    hash.add(detector.collision_free_step(test::view(m.end), test::view(m.start)));
  });
}

TEST(GoldenHashes, Snapshots) {
  constexpr Golden golden{{{0xE2B0EAC44A309D55u, 0xE2B0EAC44A309D55u, 0xE2B0EAC44A309D55u, 0xE2B0EAC44A309D55u},
                           {0x3B858D7838860B2Au, 0x3B858D7838860B2Au, 0x3B858D7838860B2Au, 0x3B858D7838860B2Au},
                           {0xE5489DCB39FA4FB8u, 0xE5489DCB39FA4FB8u, 0xE5489DCB39FA4FB8u, 0xE5489DCB39FA4FB8u},
                           {0x769C71AB98D97AF9u, 0x769C71AB98D97AF9u, 0x769C71AB98D97AF9u, 0x769C71AB98D97AF9u},
                           {0xD2B4E0AB28525ABDu, 0xD2B4E0AB28525ABDu, 0xD2B4E0AB28525ABDu, 0xD2B4E0AB28525ABDu},
                           {0xD598F771A4814E98u, 0xD598F771A4814E98u, 0xD598F771A4814E98u, 0xD598F771A4814E98u}}};
  expect(golden, {.closest = true}, [](Detector& detector, const Motion& m, Hash& hash) {
    for (const auto* positions : {&m.start, &m.end}) {
      hash.add(detector.proximity(test::view(*positions), 0.1));
      hash.add(detector.intersections(test::view(*positions)));
      hash.add(detector.distances(test::view(*positions)));
    }
  });
}

TEST(GoldenHashes, Worlds) {
  constexpr Golden golden{{{0x04A18727981A7706u, 0xC1BAF2DAE8030FE4u, 0x7E628B9963334BA9u, 0xF69B5725682843BDu},
                           {0x1C41452310A05190u, 0x6C76279B5023F9E4u, 0x96C0A2663AF578E9u, 0xC70B9959F407C0DFu},
                           {0x00A3E86044CE0FB6u, 0xF30322C9F2224BA3u, 0x3D02279E62DD950Au, 0x1A946F689CF2291Cu},
                           {0x9C059B09C3A9B2C4u, 0x3CFE446D219714B6u, 0x8633936D1230715Du, 0x32E3FC13E29D888Du},
                           {0x9C86E1113D9648ADu, 0x2F1E35DD35144D9Fu, 0x9AE2E54A198A8E00u, 0x80B78AE4AF0E2D75u},
                           {0xF25EA7108CC5258Eu, 0x591AE4AF8D4833B3u, 0xAF6F15CD456E67AEu, 0xDE51E36538D5F444u}}};
  expect(golden, {.points = true, .worlds = 2}, [](Detector& detector, const Motion& m, Hash& hash) {
    const auto both = [](std::vector<double> a, const std::vector<double>& b) {
      a.insert(a.end(), b.begin(), b.end());
      return a;
    };
    const std::vector<double> start = both(m.start, m.end), end = both(m.end, m.start);
    hash.add(detector.detect(test::view(start), test::view(end)));
    hash.add(detector.collision_free_steps(test::view(start), test::view(end)));
    hash.add(detector.proximity(test::view(end), 0.05));
    hash.add(detector.intersections(test::view(end)));
  });
}

// Pairs one by one, without a scene: of reals, and of small whole numbers.
TEST(GoldenHashes, Queries) {
  constexpr std::array<std::uint64_t, n_tiers> golden{0x0B75F38EC3077941u, 0x0C97925EFE8C6332u, 0xAF3E0D123270A76Du,
                                                      0xF23AC6757F4F9BD4u};
  Random random(5);
  std::vector<Query> queries(3000);
  for (std::size_t i = 0; i < queries.size(); ++i)
    for (double& x : queries[i]) x = i % 2 == 0 ? random.real() : random.whole(4);
  for (std::size_t tier = 0; tier < n_tiers; ++tier)
    for (const Simd simd : simd_levels()) {
      Hash hash;
      std::size_t hits = 0;
      for (const double separation : {0.0, 0.1})
        for (const auto test : {test_vertex_face, test_edge_edge}) {
          Options options;
          options.accuracy = static_cast<Accuracy>(tier), options.simd = simd, options.minimum_separation = separation;
          const auto hit = std::make_unique<bool[]>(queries.size());
          std::vector<double> toc(queries.size());
          test(queries, options, hit.get(), toc.data());
          for (std::size_t i = 0; i < queries.size(); ++i) hash.add(hit[i]), hits += hit[i];
          for (std::size_t i = 0; i < queries.size(); ++i)
            if (hit[i]) hash.add(toc[i]);
        }
      EXPECT_GT(hits, 1000u);
      EXPECT_EQ(as_constant(hash.value()), as_constant(golden[tier])) << "accuracy " << tier << ", " << name_of(simd);
    }
}

}  // namespace
}  // namespace hpccd
