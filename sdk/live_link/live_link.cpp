// The live link of `defrec track`.
#include "sdk/live_link/live_link.hpp"

#include <algorithm>
#include <exception>
#include <iterator>

#include "sdk/live_link/messages.hpp"

namespace defrec::cli {

using std::chrono::milliseconds;

LiveLink::LiveLink(const LinkOptions& options)
    : transmitter_(options), endpoint_(transmitter_.endpoint()), thread_([this] { run(); }) {}

LiveLink::~LiveLink() { end(Stage::kAbandoned); }

void LiveLink::publish(LinkFrame frame) {
    {
        const std::lock_guard lock(mutex_);
        newest_ = std::move(frame);
        ++published_;
    }
    transmitter_.wake();
}

LinkCounts LiveLink::finish() {
    end(Stage::kFinishing);
    return transmitter_.counts();
}

std::vector<std::string> LiveLink::take_notices() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notices_, {});
}

void LiveLink::end(Stage stage) {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        stage_ = stage;
    }
    transmitter_.wake();
    thread_.join();
}

void LiveLink::run() try {
    constexpr milliseconds kIdle{1000};
    const auto stage = [this] {
        const std::lock_guard lock(mutex_);
        return stage_;
    };
    while (stage() == Stage::kRunning) {
        transmitter_.step(kIdle);
        send_newest();
        collect_notices();
    }
    if (stage() == Stage::kFinishing) drain();
    collect_notices();
} catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    notices_.push_back(std::string("live link: it ends early: ") + error.what());
}

// Sends the last frame, and closes only when receivers have read it and closed in turn: closing
// earlier, with input unread, would let the system throw away what they have not read yet.
void LiveLink::drain() {
    const Clock::time_point until = Clock::now() + kDrainTime;
    const auto left = [until] { return std::chrono::ceil<milliseconds>(until - Clock::now()); };
    transmitter_.step(milliseconds(0));
    send_newest();
    while (left() > milliseconds(0) &&
           (transmitter_.is_connecting() || transmitter_.has_unsent())) {
        transmitter_.step(left());
        send_newest();
    }
    transmitter_.end_sending();
    while (left() > milliseconds(0) && transmitter_.receivers() > 0) transmitter_.step(left());
}

// Without receivers the newest frame waits for the first.
void LiveLink::send_newest() {
    if (transmitter_.receivers() == 0) return;
    std::optional<LinkFrame> frame;
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(mutex_);
        frame.swap(newest_);
        number = published_;
    }
    if (frame)
        transmitter_.offer({std::make_shared<const std::string>(pack_messages(*frame)), number});
}

void LiveLink::collect_notices() {
    std::vector<std::string> notices = transmitter_.take_notices();
    const std::lock_guard lock(mutex_);
    notices_.insert(notices_.end(), std::make_move_iterator(notices.begin()),
                    std::make_move_iterator(notices.end()));
}

}  // namespace defrec::cli
