// SPDX-License-Identifier: Apache-2.0
#include "traverse/worker.h"

#include <algorithm>
#include <chrono>

#include "elementary/undecided.h"
#include "elementary/policy.h"

namespace hpccd {
void Worker::begin(Search& search) {
  search_ = &search;
  vertex_face.clear();
  edge_edge.clear();
  counts[0] = counts[1] = {};
  fallbacks[0] = fallbacks[1] = {};
  node_pairs = leaf_pairs = 0;
  elementary_seconds = 0;
  for (auto& w : waiting_)  // what an exception left behind
    if (w) w->edge_edge.n = w->vertex_face.n = 0;
  if (!result_) result_ = std::make_unique<BatchResult>();
}

void Worker::flush() {
  if (sink) sink->flush();
  for (unsigned i = 0; i < n_rules; ++i)
    if (waiting_[i]) {
      drain(waiting_[i]->edge_edge, Kind::edge_edge, Rule::of_number(i), 1);
      drain(waiting_[i]->vertex_face, Kind::vertex_face, Rule::of_number(i), 1);
    }
}

std::size_t Worker::bytes() const {
  std::size_t b = (vertex_face.capacity() + edge_edge.capacity()) * sizeof(Contact) + sizeof(BatchResult);
  for (const auto& w : waiting_) b += w ? sizeof(Waiting) : 0;
  return b;
}

void Worker::drain(CandidateBuffer& buffer, Kind kind, Rule rule, std::uint32_t keep_below) {
  static_assert(batch_capacity - 1 + CandidateBuffer::most_per_call <= CandidateBuffer::capacity);
  if (buffer.n < keep_below) return;
  const auto start = std::chrono::steady_clock::now();
  std::uint32_t done = 0;
  while (buffer.n - done >= keep_below && done < buffer.n) {
    const std::uint32_t n = std::min(buffer.n - done, batch_capacity);
    test(buffer.first + done, buffer.second + done, n, kind, rule);
    done += n;
  }
  std::copy(buffer.first + done, buffer.first + buffer.n, buffer.first);
  std::copy(buffer.second + done, buffer.second + buffer.n, buffer.second);
  buffer.n -= done;
  elementary_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Worker::test(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind,
                  Rule rule) {
  heed_cancellation();
  std::vector<Contact>& found = kind == Kind::vertex_face ? vertex_face : edge_edge;
  constexpr std::size_t many = 1 << 16;
  if (found.capacity() - found.size() < n && found.size() >= many) grow(found, *search_->cancellation);
  BatchResult& r = *result_;
  BatchCounts& count = counts[kind == Kind::edge_edge];
  r.counts = count;
  search_->batch_test[rule.number()](search_->geometry, kind, first, second, n, r);
  count = r.counts;
  for (std::uint32_t i = 0; i < r.n_contacts; ++i) {
    const double toc = reported_time(rule.accuracy, r.toc[i], r.delta[i]);
    report(kind, {first[r.contact[i]], second[r.contact[i]], toc});
  }
  for (std::uint32_t i = 0; i < r.n_undecided; ++i)
    resolve({first[r.undecided[i]], second[r.undecided[i]], kind}, rule);
}

void Worker::resolve(const Candidate& candidate, Rule rule) {
  heed_cancellation();
  const auto [a, b, kind] = candidate;
  const UndecidedPair pair = undecided_pair(search_->geometry, candidate);
  if (const auto value =
          search_->fallback[rule.number()](rule.accuracy, pair, fallbacks[kind == Kind::edge_edge]))
    report(kind, {a, b, *value});
}

void Worker::report(Kind kind, const Contact& contact) {
  if (search_->report == Report::first) {
    double best = search_->earliest.load(std::memory_order_relaxed);
    if (contact.toc > best + simultaneous) return;
    while (contact.toc < best &&
           !search_->earliest.compare_exchange_weak(best, contact.toc, std::memory_order_relaxed)) {
    }
  }
  (kind == Kind::vertex_face ? vertex_face : edge_edge).push_back(contact);
}

}  // namespace hpccd
