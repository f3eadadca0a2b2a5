// The HTTP side of the live view: one page and what it asks for, for browsers of this computer
// that were given the token.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace defrec::cli {

struct ViewRequest {
    std::string_view body;  // of what was posted
    std::int64_t after = 0;
    bool has_overlay = false;
};
struct ViewAnswer {
    int status = 200;
    std::string body;
    const char* type = "application/octet-stream";
};

// Listens at 127.0.0.1 only. A request is refused unless its Host is this server's, its Origin, if
// it has one, as well, and it carries the token: other pages, and names that lead to this address,
// get nothing. Handlers run on the server's threads, several at a time.
class ViewServer {
  public:
    using Handler = std::function<ViewAnswer(const ViewRequest&)>;
    struct Handlers {
        Handler page, frame, surface, checks;  // GET /, /frame?after=N&overlay=1, /surface, /checks
        Handler points, recording;             // POST /points, /recording
    };

    // port 0: any that is free. Throws CliError(kOutput) where nothing can listen there.
    ViewServer(std::uint16_t port, Handlers handlers);
    // Handlers must return by themselves soon.
    ~ViewServer();
    ViewServer(const ViewServer&) = delete;
    ViewServer& operator=(const ViewServer&) = delete;

    // With the token; for the user alone.
    const std::string& url() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
