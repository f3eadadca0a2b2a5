// Numbers, names and text files, read and written the same under every locale.
#include "sdk/io/text.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "sdk/base/os/stdio_file.hpp"

namespace defrec::cli {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return result;
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row.back();
}

void turn_crlf_into_lf(std::string& text) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
        text[kept++] = text[i];
    }
    text.resize(kept);
}

}  // namespace

std::optional<double> parse_double(std::string_view text) {
    if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
    const bool negative = !text.empty() && text.front() == '-';
    const std::string magnitude =
        text.size() <= 5 ? lower(text.substr(negative ? 1 : 0)) : std::string();
    if (magnitude == ".nan") return std::numeric_limits<double>::quiet_NaN();
    if (magnitude == ".inf") {
        return negative ? -std::numeric_limits<double>::infinity()
                        : std::numeric_limits<double>::infinity();
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

std::string size_text(int width, int height) {
    return std::to_string(width).append("x").append(std::to_string(height));
}

void append_fixed(std::string& out, double value, int decimals) {
    char buffer[400];
    const auto [end, error] =
        std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
    if (error != std::errc()) return;
    const char* begin = buffer;
    const bool is_zero =
        std::none_of(buffer, end, [](char c) { return c != '-' && c != '0' && c != '.'; });
    if (is_zero && *begin == '-') ++begin;
    out.append(begin, static_cast<const char*>(end));
}

std::string format_fixed(double value, int decimals) {
    std::string result;
    append_fixed(result, value, decimals);
    return result;
}

void append_integer(std::string& out, std::int64_t value) {
    char buffer[24];
    out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    while (true) {
        const std::size_t at = text.find(separator);
        parts.push_back(text.substr(0, at));
        if (at == std::string_view::npos) return parts;
        text.remove_prefix(at + 1);
    }
}

std::string_view trim(std::string_view text) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
    constexpr std::size_t kLongestCompared = 64, kLeastBegun = 4;
    if (name.size() > kLongestCompared) return {};
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(2, name.size() / 2) + 1;
    for (const std::string& candidate : candidates) {
        const std::size_t distance = edit_distance(lower(name), lower(candidate));
        if (distance < best_distance) {
            best_distance = distance;
            best = candidate;
        }
    }
    if (!best.empty() || name.size() < kLeastBegun) return best;
    // A name that was cut short.
    for (const std::string& candidate : candidates)
        if (candidate.size() > name.size() && lower(candidate).starts_with(lower(name)) &&
            (best.empty() || candidate.size() < best.size()))
            best = candidate;
    return best;
}

void require_text(std::string_view text, const std::string& path, ExitCode code) {
    int line = 1;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '\n') ++line;
        if ((byte < 0x20 && c != '\n' && c != '\t' && c != '\r') || byte == 0x7F) {
            throw CliError(
                code,
                path + ":" + std::to_string(line) +
                    ": the file is binary (it holds control bytes); a text file was expected.");
        }
    }
}

bool precedes_by_name(const std::string& a, const std::string& b) {
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j])
                return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
            ++i;
            ++j;
            continue;
        }
        while (i < a.size() && a[i] == '0') ++i;
        while (j < b.size() && b[j] == '0') ++j;
        std::size_t i_end = i, j_end = j;
        while (i_end < a.size() && is_digit(a[i_end])) ++i_end;
        while (j_end < b.size() && is_digit(b[j_end])) ++j_end;
        if (i_end - i != j_end - j) return i_end - i < j_end - j;
        const int order = a.compare(i, i_end - i, b, j, j_end - j);
        if (order != 0) return order < 0;
        i = i_end;
        j = j_end;
    }
    const std::size_t left_of_a = a.size() - i, left_of_b = b.size() - j;
    return left_of_a != left_of_b ? left_of_a < left_of_b : a < b;
}

std::string read_file(const std::filesystem::path& path, std::size_t limit, ExitCode code) {
    const std::string name = path.string();
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) throw CliError(code, name + ": there is no such file.");
    if (!std::filesystem::is_regular_file(status))
        throw CliError(code, name + ": this is not a regular file.");

    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(open_file(path), &std::fclose);
    if (!file)
        throw CliError(code, name + ": the file cannot be opened for reading (" +
                                 std::generic_category().message(errno) + ").");
    std::string text;
    char buffer[1 << 16];
    while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, file.get())) {
        text.append(buffer, got);
        if (text.size() > limit) {
            throw CliError(code, name + ": the file is larger than " +
                                     std::to_string(limit / 1000) + " kB, the most that is read.");
        }
    }
    if (std::ferror(file.get())) throw CliError(code, name + ": reading the file failed part way.");
    return text;
}

std::string read_text_file(const std::filesystem::path& path, std::size_t limit, ExitCode code) {
    const std::string name = path.string();
    std::string text = read_file(path, limit, code);
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
        throw CliError(code, name + ": the file is UTF-16; save it as UTF-8.");
    }
    turn_crlf_into_lf(text);
    require_text(text, name, code);
    return text;
}

std::string printable(std::string_view text) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string shown;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        // U+0080 to U+009F, which some terminals obey as well, begin with C2 in UTF-8.
        const bool is_c1 =
            byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
        if (byte >= 0x20 && byte != 0x7F && !is_c1) {
            shown += text[i];
            continue;
        }
        shown += "\\x";
        shown += kDigits[byte >> 4];
        shown += kDigits[byte & 15];
        if (!is_c1) continue;
        const auto second = static_cast<unsigned char>(text[++i]);
        shown += "\\x";
        shown += kDigits[second >> 4];
        shown += kDigits[second & 15];
    }
    return shown;
}

std::string in_quotes(std::string_view word) {
    constexpr std::size_t kShown = 255;
    std::string text("'");
    return text.append(printable(word.substr(0, kShown))).append("'");
}

}  // namespace defrec::cli
