// SPDX-License-Identifier: Apache-2.0
#include "paper/scheduling.h"

#include <algorithm>
#include <thread>
#include <utility>

namespace hpccd::paper {

Scheduling::Scheduling(int threads) {
  for (int i = 0; i < threads; ++i) {
    slots_.push_back(std::make_unique<Slot>());
    slots_.back()->requests.reserve(static_cast<std::size_t>(threads));
  }
}

void Scheduling::begin() {
  for (auto& slot : slots_) {
    slot->front_triangles = 0;
    slot->n_requests = 0;
    slot->requests.clear();
    slot->message.reset();
    slot->open = true;
  }
  active_ = static_cast<int>(slots_.size());
}

void Scheduling::show_front(int thread, std::uint32_t triangles) {
  slots_[thread]->front_triangles.store(triangles, std::memory_order_relaxed);
}

bool Scheduling::requested(int thread) const { return slots_[thread]->n_requests.load(std::memory_order_relaxed) != 0; }

std::uint32_t Scheduling::distribute(int thread, TaskUnitQueue& units) {
  Slot& own = *slots_[thread];
  const std::size_t spare = units.empty() ? 0 : units.size() - 1;
  std::vector<int> served;
  served.reserve(slots_.size());
  {
    std::lock_guard lock(own.mutex);
    const auto first = own.requests.begin();
    const auto end = first + static_cast<std::ptrdiff_t>(std::min(own.requests.size(), spare));
    served.assign(first, end);
    own.requests.erase(first, end);
    own.n_requests = static_cast<std::uint32_t>(own.requests.size());
  }
  for (int other : served) {
    // On behalf of the other thread, before it is awake: the work must not count as finished while nodes are being
    // transferred.
    ++active_;
    {
      std::lock_guard lock(slots_[other]->mutex);
      slots_[other]->open = true;
    }
    wake(other, {true, units.front()});
    units.pop_front();
  }
  return static_cast<std::uint32_t>(served.size());
}

bool Scheduling::request(int thread, TaskUnitQueue& units) {
  leave(thread);
  for (;;) {
    const int distributing = distribution_thread(thread);
    if (distributing < 0) {
      if (active_ == 0) return false;
      std::this_thread::yield();  // a thread is being woken
      continue;
    }
    if (!place_request(thread, distributing)) continue;
    Slot& own = *slots_[thread];
    std::unique_lock lock(own.message_mutex);
    own.woken.wait(lock, [&] { return own.message.has_value(); });
    const Message message = *std::exchange(own.message, std::nullopt);
    if (!message.has_node) continue;
    units.push_back(message.node);
    return true;
  }
}

void Scheduling::leave(int thread) {
  Slot& own = *slots_[thread];
  {
    std::lock_guard lock(own.mutex);
    if (!own.open) return;
    own.open = false;
    own.front_triangles = 0;
    own.n_requests = 0;
  }
  --active_;
  // No thread adds requests any more: that would need an open slot. It opens again when this thread has requested work.
  for (int other : own.requests) wake(other, {false, 0});
  own.requests.clear();
}

int Scheduling::distribution_thread(int requesting) const {
  int best = -1;
  std::uint32_t most = 0;
  for (int i = 0; i < static_cast<int>(slots_.size()); ++i) {
    if (i == requesting || !slots_[i]->open) continue;
    const std::uint32_t triangles = slots_[i]->front_triangles.load(std::memory_order_relaxed);
    if (best < 0 || triangles > most) best = i, most = triangles;
  }
  return best;
}

bool Scheduling::place_request(int thread, int distributing) {
  Slot& other = *slots_[distributing];
  std::lock_guard lock(other.mutex);
  if (!other.open) return false;
  other.requests.push_back(thread);
  other.n_requests = static_cast<std::uint32_t>(other.requests.size());
  return true;
}

void Scheduling::wake(int thread, Message message) {
  Slot& slot = *slots_[thread];
  {
    std::lock_guard lock(slot.message_mutex);
    slot.message = message;
  }
  slot.woken.notify_one();
}

}  // namespace hpccd::paper
