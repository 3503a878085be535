// SPDX-License-Identifier: Apache-2.0
// The merged results of the parts of a step against a map from each pair to its first result.
#include "contacts/parts.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "hpccd/errors.h"

namespace hpccd {
namespace {

struct Said {
  double toc;
  std::array<double, 3> point;
  std::array<double, 4> weights;
  double approach;
};
template <std::size_t n>
using Pairs = std::map<std::array<std::uint32_t, n>, Said>;

// Pairs of few features, so that parts often have the same.
template <std::size_t n>
Pairs<n> random_pairs(std::mt19937_64& random, std::size_t most) {
  std::uniform_real_distribution<double> real(0, 1);
  Pairs<n> pairs;
  for (std::size_t wanted = random() % (most + 1); pairs.size() < wanted;) {
    std::array<std::uint32_t, n> pair;
    for (auto& feature : pair)
      feature = static_cast<std::uint32_t>(random() % 8) + (random() % 9 == 0 ? 0x80000000u : 0);
    pairs[pair] = {real(random),
                   {real(random), real(random), real(random)},
                   {real(random), real(random), real(random), real(random)},
                   -real(random)};
  }
  return pairs;
}

struct Part {
  Contacts contacts;
  template <std::size_t n>
  void add(const std::array<std::uint32_t, n>& pair, const Said& said) {
    contacts.points.push_back(said.point), contacts.weights.push_back(said.weights);
    contacts.approach.push_back(said.approach);
    contacts.vertices.push_back({pair[0], pair[1], pair[n - 2], pair[n - 1]});
  }
  ContactsOfPart of(double part, double parts) const {
    const Contacts& c = contacts;
    ContactsOfPart of;
    of.vf = c.vf, of.vf_toc = c.vf_toc, of.ee = c.ee, of.ee_toc = c.ee_toc;
    of.points = c.points, of.vertices = c.vertices, of.weights = c.weights, of.approach = c.approach;
    of.part = part, of.parts = parts;
    return of;
  }
};

Part part_of(const Pairs<2>& vf, const Pairs<4>& ee) {
  Part part;
  for (const auto& [pair, said] : vf) {
    part.contacts.vf.push_back(pair), part.contacts.vf_toc.push_back(said.toc);
    part.add(pair, said);
  }
  for (const auto& [pair, said] : ee) {
    part.contacts.ee.push_back(pair), part.contacts.ee_toc.push_back(said.toc);
    part.add(pair, said);
  }
  return part;
}

TEST(PartsOfAStep, TellOfEachPairWhatTheFirstOfThemSays) {
  std::mt19937_64 random(1);
  for (const std::uint32_t parts : {1u, 2u, 3u, 4u, 5u, 9u, 64u}) {
    for (const std::size_t most : {0u, 1u, 20u}) {
      Pairs<2> vf;
      Pairs<4> ee;
      std::vector<Part> kept;
      std::vector<ContactsOfPart> answers;
      for (std::uint32_t k = 0; k < parts; ++k) {
        const auto vf_of_part = random_pairs<2>(random, most);
        const auto ee_of_part = random_pairs<4>(random, most);
        const auto in_step = [&](Said said) {
          said.toc = (k + said.toc) / parts;
          said.approach *= parts;  // per step
          return said;
        };
        for (const auto& [pair, said] : vf_of_part) vf.emplace(pair, in_step(said));
        for (const auto& [pair, said] : ee_of_part) ee.emplace(pair, in_step(said));
        kept.push_back(part_of(vf_of_part, ee_of_part));
      }
      for (std::uint32_t k = 0; k < parts; ++k) answers.push_back(kept[k].of(k, parts));
      const Contacts found = contacts_of_step(answers), wanted = part_of(vf, ee).contacts;
      EXPECT_EQ(found.vf, wanted.vf);
      EXPECT_EQ(found.vf_toc, wanted.vf_toc);
      EXPECT_EQ(found.ee, wanted.ee);
      EXPECT_EQ(found.ee_toc, wanted.ee_toc);
      EXPECT_EQ(found.points, wanted.points);
      EXPECT_EQ(found.vertices, wanted.vertices);
      EXPECT_EQ(found.weights, wanted.weights);
      EXPECT_EQ(found.approach, wanted.approach);
      EXPECT_TRUE(found.normals.empty() && found.closest.empty());
      EXPECT_EQ(found.hash,
                hash_of_contacts(ContactsOfPart{wanted.vf, wanted.vf_toc, wanted.ee, wanted.ee_toc, {}, {}, {}}));
      double first = std::numeric_limits<double>::infinity();
      for (const double toc : found.vf_toc) first = std::min(first, toc);
      for (const double toc : found.ee_toc) first = std::min(first, toc);
      EXPECT_EQ(found.first_toc, first);
    }
  }
}

TEST(PartsOfAStep, RefuseContactsOfUnequalLengths) {
  const std::vector<std::array<std::uint32_t, 2>> vf(2);
  const std::vector<double> toc(1);
  const std::vector<std::array<double, 3>> points(1);
  const std::vector<double> times(2);
  ContactsOfPart short_times, short_points, short_approach;
  short_times.vf = short_points.vf = short_approach.vf = vf;
  short_times.vf_toc = toc, short_points.vf_toc = short_approach.vf_toc = times;
  short_points.points = points, short_approach.approach = toc;
  for (const ContactsOfPart& bad : {short_times, short_points, short_approach}) {
    EXPECT_THROW(contacts_of_step({&bad, 1}), InvalidArgument);
    EXPECT_THROW(hash_of_contacts(bad), InvalidArgument);
  }
}

}  // namespace
}  // namespace hpccd
