// SPDX-License-Identifier: Apache-2.0
#include "contacts/parts.h"

#include <algorithm>

#include "base/standard_arithmetic.h"
#include "contacts/hash.h"
#include "hpccd/errors.h"

namespace hpccd {
namespace {

// Feature numbers in sorting order: vertex and face, both edges, and so on.
struct Key {
  std::uint64_t a, b;
  friend auto operator<=>(const Key&, const Key&) = default;
};
Key key_of(const std::array<std::uint32_t, 2>& vf) { return {vf[0], vf[1]}; }
Key key_of(const std::array<std::uint32_t, 3>& ve) { return {ve[0], pack(ve[1], ve[2])}; }
Key key_of(const std::array<std::uint32_t, 4>& ee) { return {pack(ee[0], ee[1]), pack(ee[2], ee[3])}; }

// f(rows of a part, their times, rows of the step, their times) for each kind, in the order of the outputs.
template <class F>
void for_each_kind(F&& f) {
  using Part = ContactsOfPart;
  f(&Part::vf, &Part::vf_toc, &Contacts::vf, &Contacts::vf_toc);
  f(&Part::ee, &Part::ee_toc, &Contacts::ee, &Contacts::ee_toc);
  f(&Part::vp, &Part::vp_toc, &Contacts::vp, &Contacts::vp_toc);
  f(&Part::vv, &Part::vv_toc, &Contacts::vv, &Contacts::vv_toc);
  f(&Part::ve, &Part::ve_toc, &Contacts::ve, &Contacts::ve_toc);
}

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
  std::size_t n = 0;
  bool times = true;
  for_each_kind([&](auto pairs, auto toc, auto, auto) {
    n += (of.*pairs).size();
    times = times && (of.*pairs).size() == (of.*toc).size();
  });
  const auto all_or_none = [n](const auto& places) { return places.empty() || places.size() == n; };
  if (!times || !all_or_none(of.points) || !all_or_none(of.normals) || !all_or_none(of.closest) ||
      !all_or_none(of.vertices) || !all_or_none(of.weights) || !all_or_none(of.approach))
    throw InvalidArgument("results: contacts of unequal lengths; give them as a detector returned them");
}

double time_in_step(const ContactsOfPart& of, double toc) { return (of.part + toc) / of.parts; }

}  // namespace

std::uint64_t hash_of_contacts(const ContactsOfPart& of) {
  check_rows(of);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < of.vf.size(); ++i)
    sum += hash_of(Kind::vertex_face, of.vf[i][0], of.vf[i][1], of.vf_toc[i]);
  const auto add_edges = [&](std::uint64_t a, std::uint64_t b, double toc) {
    sum += hash_of(Kind::edge_edge, std::min(a, b), std::max(a, b), toc);
  };
  for (std::size_t i = 0; i < of.ee.size(); ++i) {
    const auto& e = of.ee[i];
    sum += hash_of(Kind::edge_edge, pack(e[0], e[1]), pack(e[2], e[3]), of.ee_toc[i]);
  }
  for (std::size_t i = 0; i < of.vp.size(); ++i) sum += hash_of_vertex_plane(of.vp[i][0], of.vp[i][1], of.vp_toc[i]);
  // Points are edges from a vertex to itself.
  for (std::size_t i = 0; i < of.vv.size(); ++i)
    add_edges(pack(of.vv[i][0], of.vv[i][0]), pack(of.vv[i][1], of.vv[i][1]), of.vv_toc[i]);
  for (std::size_t i = 0; i < of.ve.size(); ++i)
    add_edges(pack(of.ve[i][0], of.ve[i][0]), pack(of.ve[i][1], of.ve[i][2]), of.ve_toc[i]);
  return sum;
}

Contacts contacts_of_step(std::span<const ContactsOfPart> answers) {
  const StandardArithmetic arithmetic;
  for (const ContactsOfPart& answer : answers) check_rows(answer);
  Contacts step;
  const auto add_places = [&](const std::vector<Row>& rows, const std::vector<std::size_t>& first) {
    const auto add = [&](auto& places, auto from) {
      for (const Row& row : rows)
        if (const auto& of = answers[row.answer].*from; !of.empty()) places.push_back(of[first[row.answer] + row.at]);
    };
    add(step.points, &ContactsOfPart::points), add(step.normals, &ContactsOfPart::normals);
    add(step.closest, &ContactsOfPart::closest), add(step.vertices, &ContactsOfPart::vertices);
    add(step.weights, &ContactsOfPart::weights);
    // Per step, which takes as many times as long as a part.
    for (const Row& row : rows)
      if (const ContactsOfPart& of = answers[row.answer]; !of.approach.empty())
        step.approach.push_back(of.approach[first[row.answer] + row.at] * of.parts);
  };
  std::vector<std::size_t> first(answers.size());  // of this kind among the rows of each part
  for_each_kind([&](auto pairs, auto toc, auto pairs_of_step, auto toc_of_step) {
    const std::vector<Row> rows = rows_of_step(answers, pairs);
    for (const Row& row : rows) {
      const ContactsOfPart& of = answers[row.answer];
      (step.*pairs_of_step).push_back((of.*pairs)[row.at]);
      (step.*toc_of_step).push_back(time_in_step(of, (of.*toc)[row.at]));
      step.first_toc = std::min(step.first_toc, (step.*toc_of_step).back());
    }
    add_places(rows, first);
    for (std::size_t k = 0; k < answers.size(); ++k) first[k] += (answers[k].*pairs).size();
  });
  ContactsOfPart features;
  for_each_kind([&](auto pairs, auto toc, auto pairs_of_step, auto toc_of_step) {
    features.*pairs = step.*pairs_of_step, features.*toc = step.*toc_of_step;
  });
  step.hash = hash_of_contacts(features);
  return step;
}

}  // namespace hpccd
