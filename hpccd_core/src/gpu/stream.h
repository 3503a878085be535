// SPDX-License-Identifier: Apache-2.0
// Streams and events with the lifetime of their owner, and device time per stage.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gpu/memory.h"

namespace hpccd::gpu {

template <class T>
void upload(DeviceBuffer<T>& to, const void* from, std::size_t n) {
  to.reserve(std::max<std::size_t>(n, 1));
  if (n) check(cudaMemcpy(to.data(), from, n * sizeof(T), cudaMemcpyHostToDevice), "cudaMemcpy");
}

inline unsigned blocks_for(std::size_t n, unsigned threads) {
  return static_cast<unsigned>(std::max<std::size_t>(1, (n + threads - 1) / threads));
}

class Stream {
 public:
  Stream() { check(cudaStreamCreate(&stream_), "cudaStreamCreate"); }
  ~Stream() { cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "cudaEventCreate"); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  operator cudaEvent_t() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

// Work that is submitted repeatedly, with one call instead of one per kernel.
class Graph {
 public:
  Graph() = default;
  ~Graph() { drop(); }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  // Records the work that `submit` enqueues, without running it.
  template <class Submit>
  void record(cudaStream_t stream, Submit&& submit) {
    drop();
    const cudaError_t began = cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed);
    cudaGraph_t graph = nullptr;
    try {
      check(began, "cudaStreamBeginCapture");
      submit();
    } catch (...) {  // the stream must not stay in this state
      cudaStreamEndCapture(stream, &graph);
      if (graph) cudaGraphDestroy(graph);
      throw;
    }
    const cudaError_t ended = cudaStreamEndCapture(stream, &graph);
    const cudaError_t made = ended == cudaSuccess ? cudaGraphInstantiate(&graph_, graph, 0) : ended;
    if (graph) cudaGraphDestroy(graph);
    if (made != cudaSuccess) graph_ = nullptr;
    check(made, "cudaGraphInstantiate");
  }
  void launch(cudaStream_t stream) const { check(cudaGraphLaunch(graph_, stream), "cudaGraphLaunch"); }
  void drop() {
    if (graph_) cudaGraphExecDestroy(graph_);
    graph_ = nullptr;
  }

 private:
  cudaGraphExec_t graph_ = nullptr;
};

// Device time between marks on the stream; recorded on request only, since each mark costs a microsecond.
class StageTimer {
 public:
  explicit StageTimer(bool on) : on_(on) {}
  void begin(cudaStream_t s) {
    names_.clear();
    mark("", s);
  }
  void mark(const char* name, cudaStream_t s) {
    if (!on_) return;
    if (names_.size() == events_.size()) events_.push_back(std::make_unique<Event>());
    check(cudaEventRecord(*events_[names_.size()], s), "cudaEventRecord");
    names_.push_back(name);
  }
  std::map<std::string, double> stages() const {
    std::map<std::string, double> ms;
    for (std::size_t i = 1; i < names_.size(); ++i) {
      float t = 0;
      if (cudaEventElapsedTime(&t, *events_[i - 1], *events_[i]) == cudaSuccess) ms[names_[i]] += t;
    }
    return ms;
  }

 private:
  bool on_;
  std::vector<std::unique_ptr<Event>> events_;
  std::vector<const char*> names_;
};

}  // namespace hpccd::gpu
