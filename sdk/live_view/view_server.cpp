// One thread waits for all connections; others run the handlers.
#include "sdk/live_view/view_server.hpp"

#include <poll.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/base/os/random_token.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Clock = ViewConnection::Clock;
using std::chrono::milliseconds;

constexpr char kAddress[] = "127.0.0.1";
// Each waits with a browser for its next frame.
constexpr std::size_t kThreads = 16;
// For answers under way when the server ends.
constexpr milliseconds kEndTime(500);
// Without descriptors or memory for a connection.
constexpr milliseconds kPauseOfAccepting(100);
constexpr int kAcceptedAtOnce = 64;
constexpr std::size_t kMaxPageName = 32;

// Answer to an old address of the page, which is opened in the operating room as well.
constexpr char kNoAccess[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>No access – defrec</title>
<style>
body {
  margin: 0;
  padding: 5vw;
  font: 20px/1.5 system-ui, sans-serif;
  color: #fff;
  background: #1f2937;
}
h1 { margin: 0; font-size: clamp(44px, 7.5vw, 120px); line-height: 1.1; }
</style>
</head>
<body>
<h1>No access</h1>
<p>This address lacks its token, or belongs to a run that has ended: each run has a new one.</p>
<p>What to do: open the address that <b>defrec track</b> printed last, all of it, with
<b>?token=</b> and what follows.</p>
</body>
</html>
)";

// Takes as long wherever they differ.
bool is_same(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned char difference = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
    return difference == 0;
}

// This computer's names that no name server can give to another address. The port is the tunnel's
// where one leads here.
bool is_this_computer(std::string_view host) {
    constexpr std::size_t kMaxDigits = 5;
    for (const std::string_view name : {"127.0.0.1", "localhost", "[::1]"}) {
        if (!host.starts_with(name)) continue;
        const std::string_view port = host.substr(name.size());
        if (port.empty()) return true;
        return port.front() == ':' && port.size() > 1 && port.size() <= 1 + kMaxDigits &&
               std::all_of(port.begin() + 1, port.end(),
                           [](char c) { return c >= '0' && c <= '9'; });
    }
    return false;
}

// Tracking needs descriptors too.
std::size_t max_connections() {
    constexpr rlim_t kShare = 8;
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return ViewServer::kMaxConnections;
    return static_cast<std::size_t>(
        std::clamp<rlim_t>(limit.rlim_cur / kShare, 4, rlim_t{ViewServer::kMaxConnections}));
}

ViewAnswer refusal(int status, const char* reason) {
    return {status, concat(reason, "\n"), "text/plain"};
}

}  // namespace

class ViewServer::Impl {
  public:
    Impl(std::uint16_t port, Handlers handlers)
        : handlers_(std::move(handlers)), max_connections_(max_connections()) {
        try {
            listener_ = listen_at({kAddress, port}, "live view");
        } catch (const CliError& error) {
            throw CliError(error.code(), concat(error.what(),
                                                " Choose another port, or 0 for any "
                                                "that is free."));
        }
        url_ = concat("http://", kAddress, ":", local_endpoint(listener_).port, "/?token=", token_);
        for (std::size_t i = 0; i < kThreads; ++i) workers_.emplace_back([this] { work(); });
        thread_ = std::thread([this] { serve(); });
    }
    ~Impl() {
        {
            const std::lock_guard lock(mutex_);
            is_ending_ = true;
        }
        wake_up_.ring();
        thread_.join();
        has_work_.notify_all();
        for (std::thread& worker : workers_) worker.join();
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    const std::string& url() const { return url_; }

  private:
    using Id = std::uint64_t;  // of a connection, growing
    struct Work {
        Id id;
        const Handler* handler;
        HttpRequest request;
    };

    // The handler of a permitted request; null: the answer says why there is none.
    const Handler* handler_of(const HttpRequest& request, ViewAnswer& answer) const {
        const auto refuse = [&](int status, const char* reason) {
            answer = refusal(status, reason);
            return nullptr;
        };
        if (!is_this_computer(request.host)) return refuse(403, "another host");
        if (!request.origin.empty() && request.origin != "http://" + request.host)
            return refuse(403, "another origin");
        const std::string_view given =
            request.path == "/" ? request.parameter("token") : std::string_view(request.token);
        if (!is_same(given, token_)) {
            if (request.path == "/") {
                answer = {403, kNoAccess, "text/html; charset=utf-8"};
                return nullptr;
            }
            return refuse(403, "the token is missing or wrong: open the address as printed");
        }
        const std::pair<const char*, const Handler*> routes[] = {
            {"GET /", &handlers_.page},           {"GET /frame", &handlers_.frame},
            {"GET /surface", &handlers_.surface}, {"GET /checks", &handlers_.checks},
            {"POST /points", &handlers_.points},  {"POST /recording", &handlers_.recording}};
        const std::string asked = request.method + " " + request.path;
        for (const auto& [route, handler] : routes)
            if (asked == route) return handler;
        return refuse(404, "nothing is here");
    }

    void serve() {
        Clock::time_point end = Clock::time_point::max();
        std::vector<pollfd> polled;
        while (Clock::now() < end) {
            wait(polled, end);
            hand_out_answers();
            step_all(polled);
            if (end == Clock::time_point::max() && is_ending()) {
                end = Clock::now() + kEndTime;
                listener_.close();
            }
            if (end != Clock::time_point::max()) {
                std::erase_if(connections_, [](const auto& item) { return item.second.is_idle(); });
                if (connections_.empty()) break;
            } else {
                accept_browsers();
            }
        }
        connections_.clear();
    }

    bool is_ending() {
        const std::lock_guard lock(mutex_);
        return is_ending_;
    }

    // Polls the wake-up, the connections in their order, and the listener.
    void wait(std::vector<pollfd>& polled, Clock::time_point until) {
        polled.assign(1, {wake_up_.descriptor(), POLLIN, 0});
        for (const auto& [id, connection] : connections_) {
            polled.push_back({connection.descriptor(), connection.events(), 0});
            until = std::min(until, connection.deadline());
        }
        if (listener_ && accept_after_ <= Clock::now())
            polled.push_back({listener_.get(), POLLIN, 0});
        else if (listener_)
            until = std::min(until, accept_after_);
        int timeout = -1;
        if (until != Clock::time_point::max()) {
            const auto left = std::chrono::ceil<milliseconds>(until - Clock::now());
            timeout = static_cast<int>(std::max(left, milliseconds(0)).count());
        }
        ::poll(polled.data(), polled.size(), timeout);
        if (polled.front().revents != 0) wake_up_.clear();
    }

    void hand_out_answers() {
        std::deque<std::pair<Id, ViewAnswer>> answers;
        {
            const std::lock_guard lock(mutex_);
            answers.swap(answers_);
        }
        for (const auto& [id, answer] : answers) {
            const auto found = connections_.find(id);
            if (found == connections_.end()) continue;
            found->second.answer(answer, false);
            if (!go_on(found->first, found->second)) connections_.erase(found);
        }
    }

    void step_all(const std::vector<pollfd>& polled) {
        std::map<int, short> happened;
        for (const pollfd& one : polled)
            if (one.revents != 0) happened[one.fd] = one.revents;
        const Clock::time_point now = Clock::now();
        for (auto item = connections_.begin(); item != connections_.end();) {
            ViewConnection& connection = item->second;
            const auto found = happened.find(connection.descriptor());
            bool stays = connection.deadline() > now;
            if (stays && found != happened.end()) {
                // A browser that has gone while a handler works.
                const bool has_gone =
                    connection.is_working() && (found->second & (POLLHUP | POLLERR)) != 0;
                stays = !has_gone && go_on(item->first, connection);
            }
            item = stays ? std::next(item) : connections_.erase(item);
        }
    }

    // False: it has ended.
    bool go_on(Id id, ViewConnection& connection) {
        for (;;) {
            switch (connection.step()) {
                case ViewConnection::Step::kEnd:
                    return false;
                case ViewConnection::Step::kNothing:
                    return true;
                case ViewConnection::Step::kRequest:
                    begin(id, connection);
            }
        }
    }

    void begin(Id id, ViewConnection& connection) {
        ViewAnswer answer;
        const Handler* handler = handler_of(connection.request(), answer);
        // Whoever has no token gets no second try on the same connection.
        if (handler == nullptr) return connection.answer(answer, answer.status == 403);
        connection.begin_work();
        {
            const std::lock_guard lock(mutex_);
            work_.push_back({id, handler, connection.request()});
        }
        has_work_.notify_one();
    }

    void accept_browsers() {
        for (int i = 0; i < kAcceptedAtOnce; ++i) {
            Socket socket;
            switch (accept_from(listener_, socket)) {
                case Accepted::kNobody:
                    return;
                case Accepted::kNoResources:
                    accept_after_ = Clock::now() + kPauseOfAccepting;
                    return;
                case Accepted::kReceiver:
                    break;
            }
            if (connections_.size() >= max_connections_ && !make_room()) continue;
            send_at_once(socket);
            const Id id = next_id_++;
            ViewConnection& connection =
                connections_.emplace(id, ViewConnection(std::move(socket))).first->second;
            if (!go_on(id, connection)) connections_.erase(id);
        }
    }

    bool make_room() {
        const auto stranger =
            std::find_if(connections_.begin(), connections_.end(),
                         [](const auto& item) { return !item.second.is_known(); });
        if (stranger == connections_.end()) return false;
        connections_.erase(stranger);
        return true;
    }

    void work() {
        std::unique_lock lock(mutex_);
        for (;;) {
            has_work_.wait(lock, [this] { return is_ending_ || !work_.empty(); });
            if (work_.empty()) return;
            const Work work = std::move(work_.front());
            work_.pop_front();
            lock.unlock();
            ViewAnswer answer = answer_of(work);
            lock.lock();
            answers_.emplace_back(work.id, std::move(answer));
            wake_up_.ring();
        }
    }

    static ViewAnswer answer_of(const Work& work) {
        ViewRequest asked;
        asked.body = work.request.content;
        const std::string_view after = work.request.parameter("after");
        if (!after.empty()) asked.after = parse_integer(after).value_or(-1);
        asked.has_overlay = work.request.parameter("overlay") == "1";
        asked.page = work.request.parameter("page").substr(0, kMaxPageName);
        try {
            return (*work.handler)(asked);
        } catch (const std::exception& error) {
            return refusal(503, error.what());
        }
    }

    const Handlers handlers_;
    const std::string token_ = random_token();
    const std::size_t max_connections_;
    std::string url_;
    Socket listener_;
    WakeUp wake_up_;
    // For the serving thread alone.
    std::map<Id, ViewConnection> connections_;
    Id next_id_ = 0;
    Clock::time_point accept_after_{};

    std::mutex mutex_;  // of what follows
    std::condition_variable has_work_;
    std::deque<Work> work_;
    std::deque<std::pair<Id, ViewAnswer>> answers_;
    bool is_ending_ = false;

    std::vector<std::thread> workers_;
    std::thread thread_;
};

ViewServer::ViewServer(std::uint16_t port, Handlers handlers)
    : impl_(std::make_unique<Impl>(port, std::move(handlers))) {}

ViewServer::~ViewServer() = default;

const std::string& ViewServer::url() const { return impl_->url(); }

}  // namespace defrec::cli
