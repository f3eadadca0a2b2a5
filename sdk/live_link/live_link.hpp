// The live link of `defrec track`: sends frames by OpenIGTLink in a thread of its own, so that
// tracking never waits for the network.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sdk/live_link/frame.hpp"
#include "sdk/live_link/transmitter.hpp"

namespace defrec::cli {

// Holds at most, whatever receivers do: one frame that waits, and two packets for each of
// Transmitter::kMaxReceivers receivers.
class LiveLink {
  public:
    // How long finish() waits at most.
    static constexpr std::chrono::seconds kDrainTime{5};

    // Throws CliError when the host is not known or nothing can listen there. A receiver that is
    // not there yet is no failure: it is tried again until the end.
    explicit LiveLink(const LinkOptions& options);
    // Ends at once; what was not sent stays unsent.
    ~LiveLink();
    LiveLink(const LiveLink&) = delete;
    LiveLink& operator=(const LiveLink&) = delete;

    // Replaces the last frame if that was not sent to anybody yet. Not after finish().
    void publish(LinkFrame frame);
    // Sends the last frame to all who are connected and ends.
    LinkCounts finish();

    const Endpoint& endpoint() const { return endpoint_; }
    // What became of receivers since the last call, for people.
    std::vector<std::string> take_notices();

  private:
    enum class Stage { kRunning, kFinishing, kAbandoned };

    void run();
    void drain();
    void send_newest();
    void collect_notices();
    void end(Stage stage);

    Transmitter transmitter_;  // the thread's
    const Endpoint endpoint_;

    std::mutex mutex_;  // of what follows
    Stage stage_ = Stage::kRunning;
    std::optional<LinkFrame> newest_;
    std::uint64_t published_ = 0;
    std::vector<std::string> notices_;

    std::thread thread_;
};

}  // namespace defrec::cli
