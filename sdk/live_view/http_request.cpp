// See http_request.hpp.
#include "sdk/live_view/http_request.hpp"

#include <algorithm>
#include <optional>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::string_view kLineEnd = "\r\n", kHeadEnd = "\r\n\r\n";

HttpReading refused(int status, const char* reason) {
    return {HttpReading::Kind::kRefused, 0, status, reason};
}

bool is_token_char(char c) {
    constexpr std::string_view kOthers = "!#$%&'*+-.^_`|~";
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           kOthers.find(c) != std::string_view::npos;
}

bool is_token(std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), is_token_char);
}

// Without control characters but the tab.
bool is_plain(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) {
        const auto code = static_cast<unsigned char>(c);
        return (code >= 0x20 && code != 0x7F) || c == '\t';
    });
}

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

std::string_view without_blanks(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

class HeadReader {
  public:
    explicit HeadReader(HttpRequest& request) : request_(request) { request = {}; }

    // The lines without the empty one. True: understood; else refusal() says why not.
    bool read(std::string_view head) {
        const std::size_t end = head.find(kLineEnd);
        if (!read_first_line(head.substr(0, end))) return refuse(400, "no request");
        std::size_t at = end;
        for (std::size_t lines = 0; at != std::string_view::npos; ++lines) {
            if (lines == kMaxHeaders) return refuse(431, "too many headers");
            const std::size_t begin = at + kLineEnd.size();
            at = head.find(kLineEnd, begin);
            if (!read_header(head.substr(begin, at == std::string_view::npos ? at : at - begin)))
                return false;
        }
        if (!host_) return refuse(400, "no host");
        request_.host = std::move(*host_);
        request_.origin = origin_.value_or("");
        request_.token = token_.value_or("");
        return true;
    }
    const HttpReading& refusal() const { return refusal_; }
    std::size_t content() const { return content_.value_or(0); }  // bytes

  private:
    bool refuse(int status, const char* reason) {
        refusal_ = refused(status, reason);
        return false;
    }

    bool read_first_line(std::string_view line) {
        const std::size_t first = line.find(' '), second = line.find(' ', first + 1);
        if (first == std::string_view::npos || second == std::string_view::npos) return false;
        const std::string_view method = line.substr(0, first),
                               target = line.substr(first + 1, second - first - 1),
                               version = line.substr(second + 1);
        if (!is_token(method) || !target.starts_with('/') || !is_plain(target) ||
            (version != "HTTP/1.1" && version != "HTTP/1.0"))
            return false;
        const std::size_t query = target.find('?');
        request_.method = method;
        request_.path = target.substr(0, query);
        if (query != std::string_view::npos) request_.query = target.substr(query + 1);
        request_.keeps_open = version == "HTTP/1.1";
        return true;
    }

    bool read_header(std::string_view line) {
        const std::size_t colon = line.find(':');
        if (colon == std::string_view::npos || !is_token(line.substr(0, colon)) || !is_plain(line))
            return refuse(400, "a header that is none");
        const std::string name = lower(line.substr(0, colon));
        const std::string_view value = without_blanks(line.substr(colon + 1));
        if (name == "transfer-encoding") return refuse(501, "no transfer encodings");
        if (name == "content-length") return read_length(value);
        if (name == "connection" && lower(value) == "close") request_.keeps_open = false;
        std::optional<std::string>* kept = name == "host"      ? &host_
                                           : name == "origin"  ? &origin_
                                           : name == "x-token" ? &token_
                                                               : nullptr;
        if (kept == nullptr) return true;
        if (kept->has_value()) return refuse(400, "a header twice");
        *kept = value;
        return true;
    }

    bool read_length(std::string_view value) {
        constexpr std::size_t kMaxDigits = 9;
        if (content_) return refuse(400, "a header twice");
        if (value.empty() ||
            !std::all_of(value.begin(), value.end(), [](char c) { return c >= '0' && c <= '9'; }))
            return refuse(400, "no length");
        if (value.size() > kMaxDigits) return refuse(413, "too much");
        content_ = static_cast<std::size_t>(parse_integer(value).value_or(0));
        return *content_ <= kMaxContent || refuse(413, "too much");
    }

    HttpRequest& request_;
    HttpReading refusal_;
    std::optional<std::string> host_, origin_, token_;
    std::optional<std::size_t> content_;
};

}  // namespace

std::string_view HttpRequest::parameter(std::string_view name) const {
    for (const std::string_view pair : split(query, '&'))
        if (pair.size() > name.size() && pair.starts_with(name) && pair[name.size()] == '=')
            return pair.substr(name.size() + 1);
    return {};
}

HttpReading read_request(std::string_view bytes, HttpRequest& request) {
    const std::size_t end = bytes.substr(0, kMaxHead).find(kHeadEnd);
    if (end == std::string_view::npos)
        return bytes.size() < kMaxHead ? HttpReading{} : refused(431, "too long");
    HeadReader head(request);
    if (!head.read(bytes.substr(0, end))) return head.refusal();
    const std::size_t begin = end + kHeadEnd.size();
    if (bytes.size() - begin < head.content()) return {};
    request.content = bytes.substr(begin, head.content());
    return {HttpReading::Kind::kWhole, begin + head.content(), 0, nullptr};
}

}  // namespace defrec::cli
