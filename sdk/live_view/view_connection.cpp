// See view_connection.hpp.
#include "sdk/live_view/view_connection.hpp"

#include <poll.h>

#include <array>
#include <string_view>

namespace defrec::cli {
namespace {

const char* phrase_of(int status) {
    switch (status) {
        case 200:
            return "OK";
        case 202:
            return "Accepted";
        case 204:
            return "No Content";
        case 400:
            return "Bad Request";
        case 403:
            return "Forbidden";
        case 404:
            return "Not Found";
        case 410:
            return "Gone";
        case 413:
            return "Content Too Large";
        case 431:
            return "Request Header Fields Too Large";
        case 501:
            return "Not Implemented";
        default:
            return "Service Unavailable";
    }
}

constexpr std::string_view kHeaders =
    "Cache-Control: no-store\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src "
    "'unsafe-inline'; img-src data: blob:; connect-src 'self'; frame-ancestors 'none'; base-uri "
    "'none'; form-action 'none'\r\n";

std::string text_of(const ViewAnswer& answer, bool closes) {
    std::string text = "HTTP/1.1 " + std::to_string(answer.status) + " ";
    text.append(phrase_of(answer.status)).append("\r\n").append(kHeaders);
    text.append("Connection: ").append(closes ? "close" : "keep-alive").append("\r\n");
    if (answer.status == 204) return text.append("\r\n");
    text.append("Content-Type: ").append(answer.type).append("\r\n");
    text.append("Content-Length: ").append(std::to_string(answer.body.size()));
    return text.append("\r\n\r\n").append(answer.body);
}

}  // namespace

short ViewConnection::events() const {
    switch (phase_) {
        case Phase::kWriting:
            return POLLOUT;
        case Phase::kWorking:
            return 0;
        default:
            return POLLIN;
    }
}

ViewConnection::Step ViewConnection::step() {
    switch (phase_) {
        case Phase::kReading:
            return read();
        case Phase::kWriting:
            return write();
        case Phase::kLingering:
            return linger();
        default:
            return Step::kNothing;
    }
}

ViewConnection::Step ViewConnection::read() {
    std::array<char, 4096> piece{};
    while (in_.size() < kMaxHead + kMaxContent) {
        std::size_t count = 0;
        const Transfer transfer = receive_some(socket_, piece.data(), piece.size(), count);
        if (transfer == Transfer::kGone) return Step::kEnd;
        if (transfer == Transfer::kNothingNow) break;
        in_.append(piece.data(), count);
    }
    return parse();
}

ViewConnection::Step ViewConnection::parse() {
    if (!in_.empty() && !has_begun_) {
        has_begun_ = true;
        deadline_ = Clock::now() + kRequestTime;
    }
    const HttpReading reading = read_request(in_, request_);
    switch (reading.kind) {
        case HttpReading::Kind::kWhole:
            in_.erase(0, reading.size);
            return Step::kRequest;
        case HttpReading::Kind::kRefused:
            answer({reading.status, std::string(reading.reason) + "\n", "text/plain"}, true);
            return write();
        default:
            return Step::kNothing;
    }
}

void ViewConnection::answer(const ViewAnswer& answer, bool closes) {
    closes_ = closes || !request_.keeps_open;
    out_ = text_of(answer, closes_);
    sent_ = 0;
    phase_ = Phase::kWriting;
    deadline_ = Clock::now() + kAnswerTime;
}

ViewConnection::Step ViewConnection::write() {
    while (sent_ < out_.size()) {
        std::size_t count = 0;
        const Transfer transfer = send_some(socket_, std::string_view(out_).substr(sent_), count);
        if (transfer == Transfer::kGone) return Step::kEnd;
        if (transfer == Transfer::kNothingNow) return Step::kNothing;
        sent_ += count;
    }
    out_ = {};
    if (closes_) {
        end_sending(socket_);
        phase_ = Phase::kLingering;
        deadline_ = Clock::now() + kLingerTime;
        return linger();
    }
    phase_ = Phase::kReading;
    has_begun_ = false;
    deadline_ = Clock::now() + kIdleTime;
    return parse();
}

ViewConnection::Step ViewConnection::linger() {
    // No more than this at a time: others wait.
    constexpr int kPieces = 64;
    for (int i = 0; i < kPieces; ++i) {
        std::size_t count = 0;
        const Transfer transfer = discard_some(socket_, count);
        if (transfer == Transfer::kGone) return Step::kEnd;
        if (transfer == Transfer::kNothingNow) break;
    }
    return Step::kNothing;
}

}  // namespace defrec::cli
