// SPDX-License-Identifier: Apache-2.0
#include "contacts/parts.h"

#include <algorithm>

#include "base/standard_arithmetic.h"
#include "contacts/hash.h"
#include "hpccd/errors.h"

namespace hpccd {
namespace {

// Feature numbers in sorting order: vertex and face, or both edges.
struct Key {
  std::uint64_t a, b;
  friend auto operator<=>(const Key&, const Key&) = default;
};
Key key_of(const std::array<std::uint32_t, 2>& vf) { return {vf[0], vf[1]}; }
Key key_of(const std::array<std::uint32_t, 4>& ee) { return {pack(ee[0], ee[1]), pack(ee[2], ee[3])}; }

struct Row {
  Key key;
  std::uint32_t answer;
  std::uint32_t at;  // index among the rows of its kind in its part
};

// The first row of each pair among all parts. Neighbouring sorted runs are merged until one is left; of equal rows that
// of the earlier part comes first. Detectors return sorted rows; rows that a caller has selected may be unsorted.
template <class Pairs>
std::vector<Row> rows_of_step(std::span<const ContactsOfPart> answers, Pairs ContactsOfPart::* pairs) {
  const auto less = [](const Row& x, const Row& y) { return x.key < y.key; };
  std::vector<Row> rows, merged;
  std::vector<std::size_t> begins;
  for (std::uint32_t k = 0; k < answers.size(); ++k) {
    begins.push_back(rows.size());
    const auto& of = answers[k].*pairs;
    for (std::uint32_t i = 0; i < of.size(); ++i) rows.push_back({key_of(of[i]), k, i});
    const auto own = rows.begin() + static_cast<std::ptrdiff_t>(begins.back());
    if (!std::is_sorted(own, rows.end(), less)) std::stable_sort(own, rows.end(), less);
  }
  while (begins.size() > 1) {
    merged.resize(rows.size());
    std::vector<std::size_t> next;
    for (std::size_t k = 0; k < begins.size(); k += 2) {
      const auto run = [&](std::size_t i) { return rows.begin() + (i < begins.size() ? begins[i] : rows.size()); };
      std::merge(run(k), run(k + 1), run(k + 1), run(k + 2), merged.begin() + begins[k], less);
      next.push_back(begins[k]);
    }
    rows.swap(merged);
    begins.swap(next);
  }
  const auto same = [](const Row& x, const Row& y) { return x.key == y.key; };
  rows.erase(std::unique(rows.begin(), rows.end(), same), rows.end());
  return rows;
}

void check_rows(const ContactsOfPart& of) {
  const std::size_t n = of.vf.size() + of.ee.size();
  const auto all_or_none = [n](const auto& places) { return places.empty() || places.size() == n; };
  if (of.vf.size() != of.vf_toc.size() || of.ee.size() != of.ee_toc.size() || !all_or_none(of.points) ||
      !all_or_none(of.normals) || !all_or_none(of.closest) || !all_or_none(of.vertices) || !all_or_none(of.weights) ||
      !all_or_none(of.approach))
    throw InvalidArgument("results: contacts of unequal lengths; give them as a detector returned them");
}

double time_in_step(const ContactsOfPart& of, double toc) { return (of.part + toc) / of.parts; }

}  // namespace

std::uint64_t hash_of_contacts(const ContactsOfPart& contacts) {
  check_rows(contacts);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < contacts.vf.size(); ++i) {
    const auto [a, b] = key_of(contacts.vf[i]);
    sum += hash_of(Kind::vertex_face, a, b, contacts.vf_toc[i]);
  }
  for (std::size_t i = 0; i < contacts.ee.size(); ++i) {
    const auto [a, b] = key_of(contacts.ee[i]);
    sum += hash_of(Kind::edge_edge, a, b, contacts.ee_toc[i]);
  }
  return sum;
}

Contacts contacts_of_step(std::span<const ContactsOfPart> answers) {
  const StandardArithmetic arithmetic;
  for (const ContactsOfPart& answer : answers) check_rows(answer);
  const std::vector<Row> of_vf = rows_of_step(answers, &ContactsOfPart::vf);
  const std::vector<Row> of_ee = rows_of_step(answers, &ContactsOfPart::ee);
  Contacts step;
  for (const Row& row : of_vf) {
    step.vf.push_back(answers[row.answer].vf[row.at]);
    step.vf_toc.push_back(time_in_step(answers[row.answer], answers[row.answer].vf_toc[row.at]));
    step.first_toc = std::min(step.first_toc, step.vf_toc.back());
  }
  for (const Row& row : of_ee) {
    step.ee.push_back(answers[row.answer].ee[row.at]);
    step.ee_toc.push_back(time_in_step(answers[row.answer], answers[row.answer].ee_toc[row.at]));
    step.first_toc = std::min(step.first_toc, step.ee_toc.back());
  }
  const auto add_places = [&](auto& places, auto from) {
    for (const Row& row : of_vf)
      if (const auto& of = answers[row.answer].*from; !of.empty()) places.push_back(of[row.at]);
    for (const Row& row : of_ee)
      if (const auto& of = answers[row.answer].*from; !of.empty())
        places.push_back(of[answers[row.answer].vf.size() + row.at]);
  };
  add_places(step.points, &ContactsOfPart::points);
  add_places(step.normals, &ContactsOfPart::normals);
  add_places(step.closest, &ContactsOfPart::closest);
  add_places(step.vertices, &ContactsOfPart::vertices);
  add_places(step.weights, &ContactsOfPart::weights);
  add_places(step.approach, &ContactsOfPart::approach);
  // Per step, which takes as many times as long as a part.
  const auto rows = [&](const std::vector<Row>& of, std::size_t begin) {
    for (std::size_t i = 0; i < of.size() && !step.approach.empty(); ++i)
      step.approach[begin + i] *= answers[of[i].answer].parts;
  };
  rows(of_vf, 0), rows(of_ee, of_vf.size());
  ContactsOfPart features;
  features.vf = step.vf, features.vf_toc = step.vf_toc, features.ee = step.ee, features.ee_toc = step.ee_toc;
  step.hash = hash_of_contacts(features);
  return step;
}

}  // namespace hpccd
