// Pairs of images on their way to the disk: encoded by several threads, written in their order,
// and never more of them in memory than was allowed.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>
#include <vector>

namespace defrec::cli {

struct RecordedPair {
    cv::Mat left, right;
    std::shared_ptr<const void> pixels;  // keeps what the images show, where they do not own it
    double timestamp_ms = 0;
};

// The content of a file.
using Bytes = std::vector<unsigned char>;

struct EncodedPair {
    std::int64_t frame = 0;  // counts those that were taken
    Bytes left, right;
    double timestamp_ms = 0;
};

// Used by one thread.
class FrameWriter {
  public:
    struct Limits {
        unsigned threads = 1;
        std::size_t most_pairs = 1;  // that wait, are encoded or are written
    };
    using Encoder = std::function<Bytes(const cv::Mat&)>;
    // Called by one thread at a time, in the order of the frames, until it throws.
    using Sink = std::function<void(const EncodedPair&)>;

    // encode: called by all threads. Throws CliError where no thread can be started.
    FrameWriter(Limits limits, Encoder encode, Sink sink);
    // Gives up what waits; finish() writes it.
    ~FrameWriter();
    FrameWriter(const FrameWriter&) = delete;
    FrameWriter& operator=(const FrameWriter&) = delete;

    // Takes the pair where there is room; otherwise it is dropped, and counted.
    bool offer(RecordedPair pair);
    // Takes the pair as soon as there is room; false after a failure.
    bool push(RecordedPair pair);
    // Returns when all is written. Throws what encoder or sink threw first.
    void finish();

    bool has_failed() const;
    std::int64_t written() const;
    std::int64_t dropped() const { return dropped_; }

  private:
    void work();
    void write_in_order(std::unique_lock<std::mutex>& lock);
    void enqueue(RecordedPair pair);
    void stop();

    const Limits limits_;
    const Encoder encode_;
    const Sink sink_;
    std::int64_t taken_ = 0, dropped_ = 0;

    mutable std::mutex mutex_;  // of all below, but for the threads
    std::condition_variable changed_;
    struct Waiting {
        std::int64_t frame = 0;
        RecordedPair pair;
    };
    std::deque<Waiting> waiting_;
    struct Encoded {
        EncodedPair pair;
        std::exception_ptr failure;  // null: there is none
    };
    std::map<std::int64_t, Encoded> encoded_;
    std::size_t inside_ = 0;  // pairs that were taken and are not written
    std::int64_t written_ = 0;
    bool is_writing_ = false, is_ending_ = false;
    std::exception_ptr failure_;
    std::vector<std::thread> threads_;
};

}  // namespace defrec::cli
