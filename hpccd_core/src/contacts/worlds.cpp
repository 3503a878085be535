// SPDX-License-Identifier: Apache-2.0
#include "contacts/worlds.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "contacts/hash.h"
#include "contacts/places.h"

namespace hpccd {
namespace {

// Offsets of each world's rows, and the end of the last.
template <class Answer, class Rows>
std::vector<std::uint64_t> begins(const std::vector<Answer>& worlds, std::vector<Rows> Answer::* rows) {
  std::vector<std::uint64_t> begin{0};
  begin.reserve(worlds.size() + 1);
  for (const Answer& w : worlds) begin.push_back(begin.back() + (w.*rows).size());
  return begin;
}

template <class Answer>
void sum_hashes(const std::vector<Answer>& worlds, Answer& all) {
  all.hash = 0;
  all.slices.hashes.clear();
  for (const Answer& w : worlds) {
    all.hash += hash_weight(all.slices.hashes.size()) * w.hash;
    all.slices.hashes.push_back(w.hash);
  }
}

template <class Row>
void copy_rows(const std::vector<Row>& from, std::size_t first, std::size_t n, std::vector<Row>& to, std::size_t at,
               const Cancellation& cancellation) {
  in_pieces(cancellation, n, 1 << 14, [&](std::size_t begin, std::size_t end) {
    std::copy(from.begin() + static_cast<std::ptrdiff_t>(first + begin),
              from.begin() + static_cast<std::ptrdiff_t>(first + end),
              to.begin() + static_cast<std::ptrdiff_t>(at + begin));
  });
}

constexpr std::size_t worlds_a_piece = 8;  // small worlds take 0.2 us each

}  // namespace

void join_worlds(std::vector<Contacts>& worlds, ThreadPool& pool, Contacts& all) {
  const Cancellation& cancellation = pool.cancellation();
  all.slices.vf = begins(worlds, &Contacts::vf), all.slices.ee = begins(worlds, &Contacts::ee);
  const std::size_t n = all.slices.vf.back(), m = all.slices.ee.back();
  sum_hashes(worlds, all);
  all.first_tocs.clear();
  for (const Contacts& w : worlds) all.first_tocs.push_back(w.first_toc);
  all.first_toc = *std::ranges::min_element(all.first_tocs);

  // All worlds have the same outputs, which worlds without contacts do not show.
  const auto rows_of = [&](auto Contacts::* list) {
    return std::ranges::any_of(worlds, [&](const Contacts& w) { return !(w.*list).empty(); }) ? n + m : 0;
  };
  const auto make_room = [&](auto Contacts::* list, std::size_t rows) { resize(all.*list, rows, cancellation); };
  std::vector<std::function<void()>> rooms = {
      [&] { make_room(&Contacts::vf, n); }, [&] { make_room(&Contacts::vf_toc, n); },
      [&] { make_room(&Contacts::ee, m); }, [&] { make_room(&Contacts::ee_toc, m); }};
  for_each_output(all_outputs, [&](auto list) { rooms.emplace_back([&, list] { make_room(list, rows_of(list)); }); });
  parallel_for_each(pool, rooms.size(), [&](std::size_t i) { rooms[i](); });

  parallel_for(pool, worlds.size(), worlds_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t k = begin; k < end; ++k) {
      const Contacts& w = worlds[k];
      const std::size_t vf = all.slices.vf[k], ee = all.slices.ee[k];
      copy_rows(w.vf, 0, w.vf.size(), all.vf, vf, cancellation);
      copy_rows(w.vf_toc, 0, w.vf.size(), all.vf_toc, vf, cancellation);
      copy_rows(w.ee, 0, w.ee.size(), all.ee, ee, cancellation);
      copy_rows(w.ee_toc, 0, w.ee.size(), all.ee_toc, ee, cancellation);
      const auto copy_places = [&](auto Contacts::* list) {
        if ((w.*list).empty()) return;
        copy_rows(w.*list, 0, w.vf.size(), all.*list, vf, cancellation);
        copy_rows(w.*list, w.vf.size(), w.ee.size(), all.*list, n + ee, cancellation);
      };
      for_each_output(all_outputs, copy_places);
      worlds[k] = {};
    }
  });
}

void drop_worlds(Contacts& c, const std::vector<char>& dropped) {
  if (dropped.size() == 1) {
    if (dropped[0]) c = {};
    return;
  }
  WorldSlices& s = c.slices;
  const std::size_t n = c.vf.size();
  const auto keep = [&](auto& rows, bool vf, bool ee) {
    if (rows.empty()) return;
    auto to = rows.begin();
    const auto move = [&](const std::vector<std::uint64_t>& begin, std::size_t offset) {
      for (std::size_t k = 0; k < dropped.size(); ++k)
        if (!dropped[k])
          to = std::move(rows.begin() + static_cast<std::ptrdiff_t>(offset + begin[k]),
                         rows.begin() + static_cast<std::ptrdiff_t>(offset + begin[k + 1]), to);
    };
    if (vf) move(s.vf, 0);
    if (ee) move(s.ee, vf ? n : 0);
    rows.erase(to, rows.end());
  };
  for_each_output(all_outputs, [&](auto list) { keep(c.*list, true, true); });
  keep(c.vf, true, false), keep(c.vf_toc, true, false), keep(c.ee, false, true), keep(c.ee_toc, false, true);
  for (std::vector<std::uint64_t>* begin : {&s.vf, &s.ee}) {
    std::uint64_t last = 0, lost = 0;
    for (std::size_t k = 0; k < dropped.size(); ++k) {
      const std::uint64_t rows = (*begin)[k + 1] - last;
      last = (*begin)[k + 1];
      if (dropped[k]) lost += rows;
      (*begin)[k + 1] -= lost;
    }
  }
  c.hash = 0, c.first_toc = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < dropped.size(); ++k) {
    if (dropped[k]) s.hashes[k] = 0, c.first_tocs[k] = std::numeric_limits<double>::infinity();
    c.hash += hash_weight(k) * s.hashes[k];
    c.first_toc = std::min(c.first_toc, c.first_tocs[k]);
  }
}

Intersections join_worlds(std::vector<Intersections>& worlds, ThreadPool& pool) {
  Intersections all;
  all.slices.ef = begins(worlds, &Intersections::ef);
  sum_hashes(worlds, all);
  resize(all.ef, all.slices.ef.back(), pool.cancellation());
  parallel_for(pool, worlds.size(), worlds_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t k = begin; k < end; ++k) {
      copy_rows(worlds[k].ef, 0, worlds[k].ef.size(), all.ef, all.slices.ef[k], pool.cancellation());
      worlds[k] = {};
    }
  });
  return all;
}

}  // namespace hpccd
