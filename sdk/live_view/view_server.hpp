// The HTTP side of the live view: one page and what it asks for, for browsers of this computer
// that were given the token.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "sdk/live_view/view_connection.hpp"

namespace defrec::cli {

struct ViewRequest {
    std::string_view body;  // of what was posted
    std::int64_t after = 0;
    bool has_overlay = false;
    std::string page;  // which asks: a name that it gave to itself
};

// Listens at 127.0.0.1 only. A request is refused unless its Host is this computer, by one of its
// own names and with any port, so that a tunnel may end at another one; its Origin, if it has one,
// is the same; and it carries the token: other pages, and names that lead to this address, get
// nothing. Handlers run on the server's threads, several at a time.
//
// At most kMaxConnections are open. A further one takes the place of the oldest that has not shown
// the token, so that nobody is shut out by those who have none, and is closed where all have. Each
// has a time limit for a request and for fetching its answer (view_connection.hpp).
class ViewServer {
  public:
    using Handler = std::function<ViewAnswer(const ViewRequest&)>;
    struct Handlers {
        // GET /, /frame?after=N&overlay=1&page=NAME, /surface, /checks
        Handler page, frame, surface, checks;
        Handler points, recording;  // POST /points, /recording
    };

    static constexpr std::size_t kMaxConnections = 32;

    // port 0: any that is free. Throws CliError(kOutput) where nothing can listen there.
    ViewServer(std::uint16_t port, Handlers handlers);
    // Handlers must return by themselves soon. Answers under way are given some time, no more.
    ~ViewServer();
    ViewServer(const ViewServer&) = delete;
    ViewServer& operator=(const ViewServer&) = delete;

    // With the token; for the user alone.
    const std::string& url() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
