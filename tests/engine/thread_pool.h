// A caller's own scheduler over std::thread: threads are made once, so that a frame on it allocates nothing.
#pragma once

#include <cab/types.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace cab::tests {

class ThreadPool {
 public:
  // before and after (optional) run on a worker's own thread around each task.
  explicit ThreadPool(std::uint32_t workers, std::function<void()> before = {}, std::function<void()> after = {})
      : workers_(workers), before_(std::move(before)), after_(std::move(after)) {
    for (std::uint32_t worker = 1; worker < workers; ++worker) threads_.emplace_back([this, worker] { serve(worker); });
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  ~ThreadPool() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    start_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  Scheduler scheduler() { return {this, workers_, parallel_for}; }
  std::uint64_t tasks_run() const { return tasks_run_.load(); }

 private:
  using Task = void (*)(void* context, std::uint32_t task, std::uint32_t worker);

  static void parallel_for(void* user, std::uint32_t count, Task task, void* context) {
    static_cast<ThreadPool*>(user)->run(count, task, context);
  }

  void run(std::uint32_t count, Task task, void* context) {
    {
      const std::lock_guard lock(mutex_);
      task_ = task;
      context_ = context;
      count_ = count;
      next_.store(0);
      busy_ = workers_ - 1;
      ++round_;
    }
    start_.notify_all();
    work(0);
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return busy_ == 0; });
  }

  void work(std::uint32_t worker) {
    for (std::uint32_t t = next_.fetch_add(1); t < count_; t = next_.fetch_add(1)) {
      if (before_) before_();
      task_(context_, t, worker);
      if (after_) after_();
      tasks_run_.fetch_add(1);
    }
  }

  void serve(std::uint32_t worker) {
    std::uint64_t seen = 0;
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        start_.wait(lock, [&] { return stop_ || round_ != seen; });
        if (stop_) return;
        seen = round_;
      }
      work(worker);
      {
        const std::lock_guard lock(mutex_);
        --busy_;
      }
      done_.notify_one();
    }
  }

  std::uint32_t workers_;
  std::function<void()> before_, after_;
  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  bool stop_ = false;
  std::uint64_t round_ = 0;
  std::uint32_t busy_ = 0;
  Task task_ = nullptr;
  void* context_ = nullptr;
  std::uint32_t count_ = 0;
  std::atomic<std::uint32_t> next_{0};
  std::atomic<std::uint64_t> tasks_run_{0};
};

}  // namespace cab::tests
