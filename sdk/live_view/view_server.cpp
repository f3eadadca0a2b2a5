// See view_server.hpp.
#include "sdk/live_view/view_server.hpp"

#include <httplib.h>

#include <array>
#include <cstddef>
#include <random>
#include <thread>
#include <utility>

#include "sdk/base/util/error.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr char kAddress[] = "127.0.0.1";
// A browser opens up to six connections, each of which takes a thread while it is open.
constexpr std::size_t kThreads = 16;
constexpr std::size_t kMaxPosted = 1024;  // bytes

// 128 bits from the system's source of randomness.
std::string random_token() {
    std::random_device source;
    std::string token;
    constexpr char kDigits[] = "0123456789abcdef";
    for (int i = 0; i < 4; ++i) {
        std::uint32_t bits = source();
        for (int digit = 0; digit < 8; ++digit, bits >>= 4) token += kDigits[bits & 15];
    }
    return token;
}

// Takes as long wherever they differ.
bool is_same(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned char difference = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
    return difference == 0;
}

void refuse(httplib::Response& response, int status, const char* reason) {
    response.status = status;
    response.set_content(concat(reason, "\n"), "text/plain");
}

}  // namespace

struct ViewServer::Impl {
    explicit Impl(Handlers given) : handlers(std::move(given)), token(random_token()) {}

    bool is_permitted(const httplib::Request& request, httplib::Response& response) const {
        const std::string host = request.get_header_value("Host");
        if (host != authority[0] && host != authority[1]) {
            refuse(response, 403, "another host");
            return false;
        }
        const std::string origin = request.get_header_value("Origin");
        if (!origin.empty() && origin != concat("http://", host)) {
            refuse(response, 403, "another origin");
            return false;
        }
        const std::string given = request.path == "/" ? request.get_param_value("token")
                                                      : request.get_header_value("X-Token");
        if (!is_same(given, token)) {
            refuse(response, 403, "the token is missing or wrong: open the address as printed");
            return false;
        }
        return true;
    }

    httplib::Server::Handler answer_with(const Handler& handler) {
        return [&handler](const httplib::Request& request, httplib::Response& response) {
            ViewRequest asked;
            asked.body = request.body;
            if (request.has_param("after"))
                asked.after = parse_integer(request.get_param_value("after")).value_or(-1);
            asked.has_overlay = request.get_param_value("overlay") == "1";
            const ViewAnswer answer = handler(asked);
            response.status = answer.status;
            response.set_content(answer.body, answer.type);
        };
    }

    Handlers handlers;
    const std::string token;
    std::array<std::string, 2> authority;  // as the Host header has it
    std::string url;
    httplib::Server server;
    std::thread thread;
};

ViewServer::ViewServer(std::uint16_t port, Handlers handlers)
    : impl_(std::make_unique<Impl>(std::move(handlers))) {
    httplib::Server& server = impl_->server;
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    // Without the library's own SO_REUSEPORT, by which two programs would share the port.
    server.set_socket_options([](socket_t) {});
    server.set_tcp_nodelay(true);
    server.set_keep_alive_timeout(2);
    server.set_keep_alive_max_count(1000000);
    server.set_payload_max_length(kMaxPosted);
    server.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"Referrer-Policy", "no-referrer"},
         {"X-Content-Type-Options", "nosniff"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Content-Security-Policy",
          "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src "
          "data: blob:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action "
          "'none'"}});
    server.set_pre_routing_handler([this](const auto& request, auto& response) {
        return impl_->is_permitted(request, response) ? httplib::Server::HandlerResponse::Unhandled
                                                      : httplib::Server::HandlerResponse::Handled;
    });
    server.Get("/", impl_->answer_with(impl_->handlers.page));
    server.Get("/frame", impl_->answer_with(impl_->handlers.frame));
    server.Get("/surface", impl_->answer_with(impl_->handlers.surface));
    server.Get("/checks", impl_->answer_with(impl_->handlers.checks));
    server.Post("/points", impl_->answer_with(impl_->handlers.points));
    server.Post("/recording", impl_->answer_with(impl_->handlers.recording));

    const int bound = port != 0 ? (server.bind_to_port(kAddress, port) ? int{port} : -1)
                                : server.bind_to_any_port(kAddress);
    if (bound <= 0)
        throw CliError(ExitCode::kOutput,
                       concat("the live view cannot listen at port ", port,
                              "; choose another one, or 0 for any that is free."));
    impl_->authority = {concat(kAddress, ":", bound), concat("localhost:", bound)};
    impl_->url = concat("http://", impl_->authority[0], "/?token=", impl_->token);
    impl_->thread = std::thread([&server] { server.listen_after_bind(); });
    while (!server.is_running()) std::this_thread::yield();
}

ViewServer::~ViewServer() {
    impl_->server.stop();
    impl_->thread.join();
}

const std::string& ViewServer::url() const { return impl_->url; }

}  // namespace defrec::cli
