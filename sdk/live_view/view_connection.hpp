// One browser's connection: requests come in, answers go out, and for each there is a time limit.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>

#include "sdk/live_link/socket.hpp"
#include "sdk/live_view/http_request.hpp"

namespace defrec::cli {

struct ViewAnswer {
    int status = 200;
    std::string body;
    const char* type = "application/octet-stream";
};

class ViewConnection {
  public:
    using Clock = std::chrono::steady_clock;

    // How long a whole request may take to come, from the connection on or from its first byte.
    static constexpr std::chrono::seconds kRequestTime{5};
    // How long a browser that has shown the token may be silent between two.
    static constexpr std::chrono::seconds kIdleTime{15};
    // How long it may take to fetch an answer: some megabytes through a slow tunnel.
    static constexpr std::chrono::seconds kAnswerTime{20};
    // How long the rest of a refused request is thrown away, so that the refusal arrives.
    static constexpr std::chrono::seconds kLingerTime{1};

    explicit ViewConnection(Socket socket)
        : socket_(std::move(socket)), deadline_(Clock::now() + kRequestTime) {}

    int descriptor() const { return socket_.get(); }
    // The events that poll is to wait for.
    short events() const;
    Clock::time_point deadline() const { return deadline_; }
    // It has shown the token.
    bool is_known() const { return is_known_; }
    // A request is being answered by a handler.
    bool is_working() const { return phase_ == Phase::kWorking; }
    // Nothing is owed to the other side.
    bool is_idle() const { return phase_ == Phase::kReading || phase_ == Phase::kLingering; }

    enum class Step { kNothing, kRequest, kEnd };
    // Goes on after a poll. kRequest: request() is whole, and waits for answer(). kEnd: close it.
    Step step();
    const HttpRequest& request() const { return request_; }
    // The request is a handler's now; it was permitted.
    void begin_work() {
        is_known_ = true;
        phase_ = Phase::kWorking;
        deadline_ = Clock::time_point::max();
    }
    // closes: after it.
    void answer(const ViewAnswer& answer, bool closes);

  private:
    enum class Phase { kReading, kWorking, kWriting, kLingering };
    Step read();
    Step parse();
    Step write();
    Step linger();

    Socket socket_;
    Phase phase_ = Phase::kReading;
    Clock::time_point deadline_;
    bool is_known_ = false, closes_ = false;
    bool has_begun_ = true;  // a request; a first one is due at once
    std::string in_, out_;
    std::size_t sent_ = 0;  // of out_
    HttpRequest request_;
};

}  // namespace defrec::cli
