#include "sim_server/worker_pool.hpp"

namespace sls::sim {

WorkerPool::WorkerPool(std::size_t threads) : threads_(threads), shares_(threads - 1) {
  for (std::size_t i = 0; i < shares_.size(); ++i)
    shares_[i].thread = std::thread([this, i] { serve(i + 1); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  begun_.notify_all();
  for (Share& share : shares_) share.thread.join();
}

void WorkerPool::for_each(std::size_t count, const std::function<void(std::size_t)>& work) {
  {
    const std::lock_guard lock(mutex_);
    count_ = count;
    work_ = &work;
    busy_ = shares_.size();
    ++round_;
  }
  begun_.notify_all();
  std::exception_ptr error;
  do_share(0, error);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
  for (Share& share : shares_) {
    if (!error) error = share.error;
    share.error = nullptr;
  }
  if (error) std::rethrow_exception(error);
}

void WorkerPool::serve(std::size_t share) {
  std::uint64_t round = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    begun_.wait(lock, [&] { return stop_ || round_ != round; });
    if (stop_) return;
    round = round_;
    lock.unlock();
    do_share(share, shares_[share - 1].error);
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

void WorkerPool::do_share(std::size_t share, std::exception_ptr& error) const {
  try {
    for (std::size_t i = share * count_ / threads_; i < (share + 1) * count_ / threads_; ++i)
      (*work_)(i);
  } catch (...) {
    error = std::current_exception();
  }
}

}  // namespace sls::sim
