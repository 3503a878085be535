// SPDX-License-Identifier: Apache-2.0
#include "traverse/worker.h"

#include <algorithm>
#include <chrono>

#include "base/ticks.h"
#include "elementary/coincidence.h"
#include "elementary/exact/intersection.h"
#include "elementary/policy.h"
#include "elementary/undecided.h"

namespace hpccd {
namespace {

constexpr std::size_t many = 1 << 16;  // entries of a list, which must not grow without heeding a cancellation

}  // namespace

void Worker::begin(Search& search) {
  search_ = &search;
  vertex_face.clear();
  edge_edge.clear();
  edge_face.clear();
  for (BatchCounts& c : counts) c = {};
  for (FallbackCounts& c : fallbacks) c = {};
  for (std::uint64_t& n : ignored) n = 0;
  node_pairs = leaf_pairs = 0;
  elementary_seconds = 0;
  elementary_ticks = 0;
  leaf_pairs_time = {};
  first_batches_ = search.prunes ? first_batches : 0;
  grows_batches_ = search.limits_fall || search.report == Report::any;
  growing_batch_ = first_batch;
  boxes_leave_much_ = false;
  for (auto& w : waiting_)  // left behind by an exception
    if (w) w->edge_edge.n = w->vertex_face.n = 0;
  if (edge_faces_) edge_faces_->n = 0;
  if (!result_) result_ = std::make_unique<BatchResult>();
}

void Worker::begin_task() {
  vertex_face.clear();
  edge_edge.clear();
  growing_batch_ = first_batch;
  for (auto& w : waiting_)
    if (w) w->edge_edge.n = w->vertex_face.n = 0;
}

void Worker::flush() {
  if (sink) sink->flush();
  for (unsigned i = 0; i < n_rules; ++i)
    if (waiting_[i]) {
      drain(waiting_[i]->edge_edge, Kind::edge_edge, Rule::of_number(i), 1);
      drain(waiting_[i]->vertex_face, Kind::vertex_face, Rule::of_number(i), 1);
    }
  if (edge_faces_) drain(*edge_faces_, Kind::edge_face, {}, 1);
}

std::size_t Worker::bytes() const {
  std::size_t b = (vertex_face.capacity() + edge_edge.capacity() + edge_face.capacity()) * sizeof(Contact) +
                  sizeof(BatchResult) + (edge_faces_ ? sizeof(CandidateBuffer) : 0);
  for (const auto& w : waiting_) b += w ? sizeof(Waiting) : 0;
  return b;
}

// Drops the pairs from `begin` on that a filter ignores.
void Worker::drop_ignored(CandidateBuffer& buffer, std::uint32_t begin, Kind kind) {
  const FilterView& filter = *search_->filter;
  const auto keep_unless = [&](auto&& is_ignored) {
    std::uint32_t n = begin;
    for (std::uint32_t i = begin; i < buffer.n; ++i) {
      const std::uint32_t first = buffer.first[i], second = buffer.second[i];
      buffer.first[n] = first, buffer.second[n] = second;
      n += !is_ignored(first, second);
    }
    ignored[static_cast<int>(kind)] += buffer.n - n;
    buffer.n = n;
  };
  if (kind == Kind::edge_edge)
    keep_unless([&](std::uint32_t a, std::uint32_t b) { return filter.edge_edge(a, b); });
  else if (kind == Kind::vertex_face)
    keep_unless([&](std::uint32_t v, std::uint32_t f) { return filter.vertex_face(v, f); });
  else
    keep_unless([&](std::uint32_t e, std::uint32_t f) { return filter.edge_face(e, f); });
}

void Worker::drain(CandidateBuffer& buffer, Kind kind, Rule rule, std::uint32_t keep_below) {
  static_assert(batch_capacity - 1 + CandidateBuffer::most_per_call <= CandidateBuffer::capacity);
  if (buffer.n < keep_below) return;
  first_batches_ -= first_batches_ > 0;
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t start_ticks = ticks();
  std::uint32_t done = 0;
  nearer_ = false;
  while (buffer.n - done >= keep_below && done < buffer.n) {
    const std::uint32_t n = std::min(buffer.n - done, batch_capacity);
    test(buffer.first + done, buffer.second + done, n, kind, rule);
    done += n;
  }
  std::copy(buffer.first + done, buffer.first + buffer.n, buffer.first);
  std::copy(buffer.second + done, buffer.second + buffer.n, buffer.second);
  buffer.n -= done;
  growing_batch_ = nearer_ ? first_batch : std::min(2 * growing_batch_, batch_capacity);
  std::uint64_t tested = 0, near = 0;
  for (const BatchCounts& c : counts) tested += c.tested, near += c.contacts + c.undecided;
  boxes_leave_much_ = tested > 4096 && tested > 64 * near;
  elementary_ticks += ticks() - start_ticks;
  elementary_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

namespace {

template <class Drop>
void drop_pairs(CandidateBuffer& pairs, std::uint32_t begin, Drop&& drop) {
  std::uint32_t n = begin;
  for (std::uint32_t i = begin; i < pairs.n; ++i) {
    pairs.first[n] = pairs.first[i], pairs.second[n] = pairs.second[i];
    n += !drop(pairs.first[i], pairs.second[i]);
  }
  pairs.n = n;
}

}  // namespace

void Worker::drop_points_at_faces(CandidateBuffer& edge_edge, std::uint32_t begin) const {
  const EdgeKind* kinds = search_->edge_kinds;
  drop_pairs(edge_edge, begin, [&](std::uint32_t a, std::uint32_t b) { return never_paired(kinds[a], kinds[b]); });
}

void Worker::drop_points(CandidateBuffer& edge_face, std::uint32_t begin) const {
  const EdgeKind* kinds = search_->edge_kinds;
  drop_pairs(edge_face, begin, [&](std::uint32_t edge, std::uint32_t) { return kinds[edge] == EdgeKind::point; });
}

void Worker::test_pairs(std::span<const std::uint32_t> first, std::span<const std::uint32_t> second, Kind kind,
                        Rule rule) {
  for (std::size_t i = 0; i < first.size(); i += batch_capacity) {
    const auto n = static_cast<std::uint32_t>(std::min<std::size_t>(first.size() - i, batch_capacity));
    test(first.data() + i, second.data() + i, n, kind, rule);
  }
}

void Worker::keep(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Rule rule) {
  auto group = std::ranges::find_if(
      *kept, [&](const PairGroup& g) { return g.kind == kind && g.rule.number() == rule.number(); });
  if (group == kept->end()) group = kept->insert(kept->end(), {kind, rule, {}, {}});
  for (std::vector<std::uint32_t>* list : {&group->first, &group->second})
    if (list->capacity() - list->size() < n && list->size() >= many) grow(*list, *search_->cancellation);
  group->first.insert(group->first.end(), first, first + n);
  group->second.insert(group->second.end(), second, second + n);
}

void Worker::test(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Rule rule) {
  heed_cancellation();
  if (kept) keep(first, second, n, kind, rule);
  if (rule.separated && search_->geometry.separations.may_be_zero)
    test_thick(first, second, n, kind, rule);
  else
    test_batch(geometry_of(first, second, n, kind), first, second, n, kind, rule);
}

// Pairs without a separation have their own tests.
void Worker::test_thick(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind,
                        Rule rule) {
  const Separations& separations = search_->geometry.separations;
  limits_.resize(batch_capacity);
  std::uint32_t n_thick = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint32_t v[4];
    pair_vertices(search_->geometry, kind, first[i], second[i], v);
    limits_[i] = separations.look_up(kind, first[i], second[i], v);
    n_thick += limits_[i] > 0;
  }
  limited_ = search_->geometry;
  if (const float until = search_->until(); until < 1) limited_.until = until;
  limited_.separations.of_candidates = limits_.data();
  if (n_thick == n) return test_batch(limited_, first, second, n, kind, rule);
  first_.resize(batch_capacity), second_.resize(batch_capacity);
  std::uint32_t thick = 0, thin = n_thick;  // thick pairs first
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t to = limits_[i] > 0 ? thick++ : thin++;
    first_[to] = first[i], second_[to] = second[i];
  }
  std::erase_if(limits_, [](double limit) { return !(limit > 0); });
  if (n_thick > 0) test_batch(limited_, first_.data(), second_.data(), n_thick, kind, rule);
  rule.separated = false;
  test_batch(limited_, first_.data() + n_thick, second_.data() + n_thick, n - n_thick, kind, rule);
}

void Worker::test_batch(const Geometry& geometry, const std::uint32_t* first, const std::uint32_t* second,
                        std::uint32_t n, Kind kind, Rule rule) {
  std::vector<Contact>& list = found(kind);
  if (list.capacity() - list.size() < n && list.size() >= many) grow(list, *search_->cancellation);
  BatchResult& r = *result_;
  BatchCounts& count = counts[static_cast<int>(kind)];
  r.counts = count;
  if (kind == Kind::edge_face) {
    search_->intersection_batch(search_->geometry, first, second, n, r);
    std::fill_n(r.toc, r.n_contacts, 0.0);
    std::fill_n(r.delta, r.n_contacts, 0.0);
  } else {
    search_->batch_test[rule.number()](geometry, kind, first, second, n, r);
  }
  count = r.counts;
  const bool rounds_down = search_->time_only && rule.accuracy == Accuracy::exact;
  const Accuracy reported_as = rounds_down ? Accuracy::conservative : rule.accuracy;
  for (std::uint32_t i = 0; i < r.n_contacts; ++i) {
    const double toc = reported_time(reported_as, r.toc[i], r.delta[i]);
    report(kind, {first[r.contact[i]], second[r.contact[i]], toc});
  }
  if (search_->bounded()) search_->n_found += r.n_contacts + r.n_undecided;
  for (std::uint32_t i = 0; i < r.n_undecided; ++i)
    resolve({first[r.undecided[i]], second[r.undecided[i]], kind}, rule, r.apart_until[i]);
}

void Worker::resolve(const Candidate& candidate, Rule rule, double apart_until) {
  heed_cancellation();
  const auto [a, b, kind] = candidate;
  FallbackCounts& count = fallbacks[static_cast<int>(kind)];
  if (kind == Kind::edge_face) {
    Vec3<double> q[5];
    edge_face_positions(search_->geometry, a, b, q);
    if (!share_a_place<2>(q)) {
      ++count.integers;
      if (!exact::intersect(q)) return;
    }
    report(kind, {a, b, 0});
    return;
  }
  UndecidedPair pair = undecided_pair(search_->geometry, candidate);
  pair.apart_until = apart_until;
  if (search_->limits_fall) {
    pair.separation = search_->limit_of(kind, a, b);
    if (pair.separation < 0) return;
  }
  if (const auto value = search_->fallback[rule.number()](rule.accuracy, pair, count)) report(kind, {a, b, *value});
}

// With the time up to which pairs matter, and the limit of each pair of the batch, if the search uses them.
const Geometry& Worker::geometry_of(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                                    Kind kind) {
  const float until = search_->until();
  const bool limits_each = search_->limits_fall || search_->geometry.separations.to_look_up();
  if (!(until < 1) && !limits_each) return search_->geometry;
  limited_ = search_->geometry;
  if (until < 1) limited_.until = until;
  if (limits_each) {
    limits_.resize(batch_capacity);
    for (std::uint32_t i = 0; i < n; ++i) limits_[i] = search_->limit_of(kind, first[i], second[i]);
    limited_.separations.of_candidates = limits_.data();
  }
  return limited_;
}

std::vector<Contact>& Worker::found(Kind kind) {
  return kind == Kind::vertex_face ? vertex_face : kind == Kind::edge_edge ? edge_edge : edge_face;
}

void Worker::report(Kind kind, const Contact& contact) { nearer_ |= search_->take(kind, contact, found(kind)); }

}  // namespace hpccd
