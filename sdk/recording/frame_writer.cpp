// See frame_writer.hpp.
#include "sdk/recording/frame_writer.hpp"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

FrameWriter::FrameWriter(Limits limits, Encoder encode, Sink sink)
    : limits_{std::max(1U, limits.threads), std::max<std::size_t>(1, limits.most_pairs)},
      encode_(std::move(encode)),
      sink_(std::move(sink)) {
    try {
        while (threads_.size() < limits_.threads) threads_.emplace_back([this] { work(); });
    } catch (const std::system_error& error) {
        stop();
        throw CliError(ExitCode::kInternal,
                       std::string("a thread that encodes images cannot be started (") +
                           error.code().message() + ").");
    }
}

FrameWriter::~FrameWriter() {
    {
        const std::lock_guard lock(mutex_);
        waiting_.clear();
    }
    stop();
}

void FrameWriter::stop() {
    {
        const std::lock_guard lock(mutex_);
        is_ending_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
}

bool FrameWriter::offer(RecordedPair pair) {
    {
        const std::lock_guard lock(mutex_);
        if (failure_ || inside_ >= limits_.most_pairs) {
            ++dropped_;
            return false;
        }
        enqueue(std::move(pair));
    }
    changed_.notify_all();
    return true;
}

bool FrameWriter::push(RecordedPair pair) {
    {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return failure_ || inside_ < limits_.most_pairs; });
        if (failure_) return false;
        enqueue(std::move(pair));
    }
    changed_.notify_all();
    return true;
}

void FrameWriter::enqueue(RecordedPair pair) {
    waiting_.push_back({taken_++, std::move(pair)});
    ++inside_;
}

void FrameWriter::finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return failure_ ? !is_writing_ : inside_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
}

bool FrameWriter::has_failed() const {
    const std::lock_guard lock(mutex_);
    return failure_ != nullptr;
}

std::int64_t FrameWriter::written() const {
    const std::lock_guard lock(mutex_);
    return written_;
}

void FrameWriter::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return is_ending_ || !waiting_.empty(); });
        if (waiting_.empty()) return;
        const Waiting next = std::move(waiting_.front());
        waiting_.pop_front();
        lock.unlock();
        Encoded encoded{{next.frame, {}, {}, next.pair.timestamp_ms}, nullptr};
        try {
            encoded.pair.left = encode_(next.pair.left);
            encoded.pair.right = encode_(next.pair.right);
        } catch (...) {
            encoded.failure = std::current_exception();
        }
        lock.lock();
        encoded_.emplace(next.frame, std::move(encoded));
        if (!is_writing_) write_in_order(lock);
        changed_.notify_all();
    }
}

// By whichever thread has encoded a pair while nobody writes.
void FrameWriter::write_in_order(std::unique_lock<std::mutex>& lock) {
    is_writing_ = true;
    while (!failure_ && !encoded_.empty() && encoded_.begin()->first == written_) {
        Encoded next = std::move(encoded_.begin()->second);
        encoded_.erase(encoded_.begin());
        lock.unlock();
        if (!next.failure) {
            try {
                sink_(next.pair);
            } catch (...) {
                next.failure = std::current_exception();
            }
        }
        lock.lock();
        if (next.failure) {
            failure_ = next.failure;
            // Pairs after one that is missing are of no use.
            waiting_.clear();
            encoded_.clear();
            break;
        }
        ++written_;
        --inside_;
        changed_.notify_all();
    }
    is_writing_ = false;
}

}  // namespace defrec::cli
