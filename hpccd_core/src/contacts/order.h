// SPDX-License-Identifier: Apache-2.0
// Sorts contacts by their feature pairs, vertex-face before edge-edge, in buckets that threads can sort independently.
// No pair occurs twice, so the order is unique.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "traverse/worker.h"

namespace hpccd {

class ContactOrder {
 public:
  // Distributes the workers' contacts to buckets. `meanwhile(i)`, for each i < n_meanwhile, runs concurrently.
  template <class Job>
  void distribute(const std::vector<Worker>& workers, ThreadPool& pool, std::size_t n_meanwhile, Job&& meanwhile) {
    count(workers, pool);
    parallel_for(pool, lists_.size() + n_meanwhile, 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i)
        i < lists_.size() ? scatter(i, pool.cancellation()) : meanwhile(i - lists_.size());
    });
  }

  std::size_t buckets() const { return begin_.size() - 1; }
  // Index of the bucket's first contact.
  std::size_t begin(std::size_t bucket) const { return begin_[bucket]; }
  std::size_t end(std::size_t bucket) const { return begin_[bucket + 1]; }
  void sort(std::size_t bucket, const Cancellation& cancellation);
  const Contact& operator[](std::size_t i) const { return all_[i]; }

  std::size_t bytes() const { return all_.capacity() * sizeof(Contact); }

 private:
  struct List {
    const std::vector<Contact>* found;
    std::size_t first_bucket, n_buckets;
    double buckets_per_feature;
    std::vector<std::size_t> next;  // by bucket: the number of contacts, then the position of the next one
    std::size_t bucket_of(const Contact& f) const { return static_cast<std::size_t>(f.first * buckets_per_feature); }
  };

  void count(const std::vector<Worker>& workers, ThreadPool& pool);
  void add_lists(const std::vector<Worker>& workers, std::vector<Contact> Worker::* found, ThreadPool& pool);
  void scatter(std::size_t list, const Cancellation& cancellation);

  std::vector<List> lists_;
  std::vector<std::size_t> begin_;
  std::vector<Contact> all_;
};

}  // namespace hpccd
