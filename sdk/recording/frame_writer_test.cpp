// Order, memory and failures of what writes a recording.
#include "sdk/recording/frame_writer.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <stdexcept>

using namespace defrec::cli;

namespace {

RecordedPair pair_of(int value) {
    return {cv::Mat(2, 2, CV_8UC1, cv::Scalar(value)), cv::Mat(2, 2, CV_8UC1, cv::Scalar(value)),
            nullptr, static_cast<double>(value)};
}

Bytes first_pixel(const cv::Mat& image) { return {image.data[0]}; }

// Closed until it is opened.
class Gate {
  public:
    void open() {
        {
            const std::lock_guard lock(mutex_);
            is_open_ = true;
        }
        changed_.notify_all();
    }
    void pass() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return is_open_; });
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_open_ = false;
};

}  // namespace

TEST_CASE("pairs are written in their order, however long each takes to encode") {
    constexpr int kPairs = 200;
    std::vector<EncodedPair> written;
    std::atomic<int> inside = 0, most = 0;
    FrameWriter writer(
        {4, 8},
        [&](const cv::Mat& image) {
            const int now = ++inside;
            int before = most;
            while (before < now && !most.compare_exchange_weak(before, now)) {
            }
            // Every third takes longer.
            for (volatile int i = 0; i < (image.data[0] % 3 == 0 ? 20000 : 10);) i = i + 1;
            --inside;
            return first_pixel(image);
        },
        [&](const EncodedPair& pair) { written.push_back(pair); });
    for (int i = 0; i < kPairs; ++i) CHECK(writer.push(pair_of(i)));
    writer.finish();
    REQUIRE(written.size() == kPairs);
    for (int i = 0; i < kPairs; ++i) {
        const EncodedPair& pair = written[static_cast<std::size_t>(i)];
        CHECK(pair.frame == i);
        CHECK(pair.timestamp_ms == i);
        CHECK(pair.left == Bytes{static_cast<unsigned char>(i)});
        CHECK(pair.right == pair.left);
    }
    CHECK(most <= 4);
    CHECK(writer.written() == kPairs);
    CHECK(writer.dropped() == 0);
}

TEST_CASE("a disk that stands still costs frames, which are counted, and no memory") {
    constexpr int kMost = 5, kOffered = 50;
    Gate disk;
    std::vector<double> times;
    FrameWriter writer({2, kMost}, first_pixel, [&](const EncodedPair& pair) {
        disk.pass();
        times.push_back(pair.timestamp_ms);
    });
    int taken = 0;
    for (int i = 0; i < kOffered; ++i) taken += writer.offer(pair_of(i)) ? 1 : 0;
    CHECK(taken == kMost);
    CHECK(writer.dropped() == kOffered - kMost);
    CHECK(writer.written() == 0);
    disk.open();
    writer.finish();
    CHECK(times == std::vector<double>{0, 1, 2, 3, 4});
    CHECK(writer.offer(pair_of(kOffered)));
    writer.finish();
    CHECK(times.back() == kOffered);
    CHECK(writer.dropped() == kOffered - kMost);
}

TEST_CASE("nothing is written after a pair that could not be") {
    std::vector<std::int64_t> frames;
    FrameWriter writer({3, 100}, first_pixel, [&](const EncodedPair& pair) {
        if (pair.frame == 7) throw std::runtime_error("the disk is full");
        frames.push_back(pair.frame);
    });
    bool is_taken = true;
    for (int i = 0; i < 1000 && is_taken; ++i) is_taken = writer.push(pair_of(i));
    CHECK_FALSE(is_taken);
    CHECK(writer.has_failed());
    CHECK_THROWS_WITH(writer.finish(), "the disk is full");
    CHECK_FALSE(writer.offer(pair_of(1)));
    CHECK(frames == std::vector<std::int64_t>{0, 1, 2, 3, 4, 5, 6});
    CHECK(writer.written() == 7);
}

TEST_CASE("an image that cannot be encoded ends the recording before it") {
    std::vector<std::int64_t> frames;
    FrameWriter writer(
        {2, 4},
        [](const cv::Mat& image) {
            if (image.data[0] == 3) throw std::runtime_error("no image");
            return first_pixel(image);
        },
        [&](const EncodedPair& pair) { frames.push_back(pair.frame); });
    bool is_taken = true;
    for (int i = 0; i < 100 && is_taken; ++i) is_taken = writer.push(pair_of(i));
    CHECK_THROWS_WITH(writer.finish(), "no image");
    CHECK(frames == std::vector<std::int64_t>{0, 1, 2});
}

TEST_CASE("a writer that is left alone gives up what waits, and ends") {
    std::atomic<int> written = 0;
    {
        FrameWriter writer({1, 10}, first_pixel, [&](const EncodedPair&) { ++written; });
        for (int i = 0; i < 10; ++i) writer.offer(pair_of(i));
    }
    CHECK(written <= 10);
}
