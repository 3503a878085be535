// SPDX-License-Identifier: Apache-2.0
// Launches the stages of a frame one after the other on one stream.
#pragma once

#include <algorithm>

#include "gpu/launch_params.cuh"
#include "gpu/pipeline.h"
#include "gpu/stream.h"

namespace hpccd::gpu {

// The number of a kernel's blocks that fit on one multiprocessor of the current device; determined once.
int blocks_that_fit(const void* kernel, unsigned threads, const char* name);

struct Stages {
  int multiprocessors;
  cudaStream_t stream;
  StageTimer& timer;

  // As many blocks as fit; they take work until there is none. Rows: number of lists, each with that many blocks.
  template <class Kernel, class T>
  void persistent(Kernel kernel, unsigned threads, const LaunchParams<T>& params, const char* name,
                  unsigned rows = 1) const {
    const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, name);
    kernel<<<dim3(static_cast<unsigned>(blocks * multiprocessors), rows), threads, 0, stream>>>(params);
    check_launch(name);
  }
  // One thread per item, up to `most` items; the last argument is the number of concurrent warps (item_of_thread.cuh).
  template <class Kernel, class Task>
  void one_item_each(Kernel kernel, unsigned threads, u64 most, const char* name, const Task& task) const {
    if (most == 0) return;
    const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, name);
    const unsigned resident = static_cast<unsigned>(blocks * multiprocessors);
    kernel<<<std::max(blocks_for(most, threads), resident), threads, 0, stream>>>(task, resident * (threads / 32));
    check_launch(name);
  }
  void mark(const char* name) const { timer.mark(name, stream); }
};

// The best time from the hints. Defined for float and double.
template <class T>
void launch_hints(Query query, const LaunchParams<T>& params, const Stages& stages);

// From pairs of leaves to contacts and the fallback's decisions, in single precision first. Defined for float and
// double.
template <class T>
void launch_likely(const LaunchParams<T>& params, const Stages& stages);

// Decides what the fallback leaves undecided. Defined for float and double.
template <class T>
void launch_integers(const LaunchParams<T>& params, const Stages& stages);

// From pairs of leaves to survivors of the first filter, and the tests with a distance. Defined for float and double.
template <class T>
void launch_separation_candidates(const LaunchParams<T>& params, const Stages& stages);
template <class T>
void launch_separations(const LaunchParams<T>& params, const Stages& stages);
template <class T>
void launch_snapshot(Query query, const LaunchParams<T>& params, const Stages& stages);

// Points of one world, and their results.
struct PointsTask {
  const double* points;  // x y z of each
  u64 n;
  u32 mesh;
  bool with_distances;
  std::int32_t* numbers;
  PointOnFace* nearest;   // for distances; without winding numbers
  WorldCounters* extent;  // of the mesh
};
template <class T>
void launch_points(const LaunchParams<T>& params, const PointsTask& task, const Stages& stages);

}  // namespace hpccd::gpu
