// SPDX-License-Identifier: Apache-2.0
// The stages of the elementary tests and the lists between them: from pairs of leaves to contacts.
#pragma once

#include <algorithm>
#include <iterator>

#include "gpu/launch_params.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

class TestLists {
 public:
  struct Sizes {
    std::size_t survivors[2], single[2], many[2], separated[2], undecided, open, to_host;
    void include(const Sizes& s) {
      for (int k = 0; k < 2; ++k) {
        survivors[k] = std::max(survivors[k], s.survivors[k]);
        single[k] = std::max(single[k], s.single[k]);
        many[k] = std::max(many[k], s.many[k]);
        separated[k] = std::max(separated[k], s.separated[k]);
      }
      undecided = std::max(undecided, s.undecided);
      open = std::max(open, s.open);
      to_host = std::max(to_host, s.to_host);
    }
  };
  // Initial sizes that most scenes outgrow once or never; lists grow when they overflow. Few pairs need integers; each
  // place on that list costs the start of a thread (stages.cuh).
  TestLists(std::size_t survivors, std::size_t later, std::size_t undecided) {
    reserve({{survivors, survivors}, {later, later}, {later, later}, {0, 0}, undecided, undecided / 8, undecided});
  }

  void reserve(const Sizes& s) {
    for (int k = 0; k < 2; ++k)
      survivors_[k].reserve(s.survivors[k]), single_[k].reserve(s.single[k]), many_[k].reserve(s.many[k]),
          separated_[k].reserve(s.separated[k]);
    undecided_.reserve(s.undecided);
    for (auto& list : open_) list.reserve(s.open);
    answers_.reserve_filled(s.open, 0xFF);
    to_host_.reserve(s.to_host);
  }
  Sizes sizes() const {
    return {{survivors_[0].size(), survivors_[1].size()},
            {single_[0].size(), single_[1].size()},
            {many_[0].size(), many_[1].size()},
            {separated_[0].size(), separated_[1].size()},
            undecided_.size(),
            open_[0].size(),
            to_host_.size()};
  }

  template <class Visit>
  void for_buffers(Visit&& visit) const {
    for (int k = 0; k < 2; ++k) visit(survivors_[k]), visit(single_[k]), visit(many_[k]), visit(separated_[k]);
    for (const auto& list : open_) visit(list);
    visit(answers_), visit(undecided_), visit(to_host_);
  }

  // The source of the pairs that pass the first filter.
  enum class From : bool { leaves, near_list };
  // All stages on the pairs of leaves that the frame lists, or on existing survivors; the frame's counters must be
  // cleared, and memory for contacts allocated. Defined for float and double.
  template <class T>
  void launch(Query query, From from, LaunchParams<T>& params, int multiprocessors, cudaStream_t stream,
              StageTimer& timer);
  // Where they are to be found.
  template <class T>
  void fill(LaunchParams<T>& params) const {
    const auto list = [](const DeviceBuffer<uint2>& b) { return PairList{b.data(), b.size()}; };
    for (int k = 0; k < 2; ++k) {
      params.survivors[k] = list(survivors_[k]), params.separated[k] = list(separated_[k]);
      params.single[k] = list(single_[k]), params.many[k] = list(many_[k]);
    }
    params.undecided = undecided_.data(), params.undecided_capacity = undecided_.size();
    for (int i = 0; i < integer_sizes; ++i) params.open_in_integers[i] = open_[i].data();
    params.answers = answers_.data();
    // After a failed allocation one may be shorter.
    params.open_capacity =
        std::min(std::min_element(std::begin(open_), std::end(open_), shorter)->size(), answers_.size());
    params.to_host = to_host_.data(), params.to_host_capacity = to_host_.size();
  }

  // Allocates memory for survivors of one kind.
  void make_room(std::size_t n) {
    for (auto& list : survivors_) list.reserve(n);
  }
  // Enlarges lists that were too short. True if the pairs must be tested again.
  bool grow(const Counters& c, From from) {
    bool again = false, more_segments = false;
    const auto grow = [&](auto& buffer, u64 needed, bool divisible) {
      if (needed <= buffer.size()) return;
      again = true;
      if (divisible && from == From::leaves && needed > most_listed) {
        buffer.reserve(most_listed);
        more_segments = true;  // twice as many; the next pass shows whether that is enough
      } else {
        buffer.reserve(needed + needed / 4);
      }
    };
    for (int k = 0; k < 2; ++k) {
      grow(survivors_[k], c.most_survivors, true);
      grow(single_[k], c.most_single, true);
      grow(many_[k], c.most_many, true);
      grow(separated_[k], c.most_separated, true);
    }
    grow(undecided_, c.undecided, false);
    for (auto& list : open_) grow(list, c.open_in_integers[0], false);  // no list is longer than the first
    if (c.open_in_integers[0] > answers_.size()) {
      again = true;
      answers_.reserve_filled(c.open_in_integers[0] + c.open_in_integers[0] / 4, 0xFF);
    }
    grow(to_host_, c.to_host, false);
    if (more_segments) n_segments_ *= 2;
    return again;
  }

  // Keys of the pairs that the last launch left to exact arithmetic, in page-locked memory.
  const u64* to_host() const { return to_host_.data(); }
  u32 n_segments() const { return n_segments_; }
  std::size_t bytes() const {
    std::size_t b = undecided_.bytes() + integer_sizes * open_[0].bytes() + answers_.bytes();
    for (int k = 0; k < 2; ++k)
      b += survivors_[k].bytes() + single_[k].bytes() + many_[k].bytes() + separated_[k].bytes();
    return b;
  }

 private:
  DeviceBuffer<uint2> survivors_[2], single_[2], many_[2], separated_[2];
  DeviceBuffer<u64> undecided_, open_[integer_sizes];
  DeviceBuffer<double> answers_;
  PinnedBuffer<u64> to_host_;
  // Lists of one pass stay below this size; larger frames take several segments.
  static constexpr std::size_t most_listed = std::size_t{1} << 26;
  u32 n_segments_ = 1;

  static bool shorter(const DeviceBuffer<u64>& a, const DeviceBuffer<u64>& b) { return a.size() < b.size(); }
};

}  // namespace hpccd::gpu
