#include "sdk/plugin/manifest.hpp"

#include <doctest/doctest.h>

#include <clocale>
#include <string>
#include <vector>

#include "sdk/base/util/error.hpp"

using namespace defrec;

namespace {

const std::string kHash(64, 'a');

std::string good_text() {
    return R"({"name": "cpu", "version": "0.1", "library": "cpu.so", "abi_major": 1, )"
           R"("abi_minor": 0, "sha256": ")" +
           kHash + "\"}";
}

PluginManifest parse(const std::string& text) {
    return parse_manifest("/m.json", std::vector<unsigned char>(text.begin(), text.end()));
}

// The error message of the refusal; "" if there was none.
std::string refusal(const std::string& text) {
    try {
        parse(text);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_PLUGIN);
        CHECK(std::string(error.what()).starts_with("/m.json: "));
        return error.what();
    }
    return "";
}

std::string with(const std::string& from, const std::string& to) {
    std::string text = good_text();
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

bool contains(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a manifest is read") {
    const PluginManifest manifest = parse(good_text());
    CHECK(manifest.name == "cpu");
    CHECK(manifest.version == "0.1");
    CHECK(manifest.library == "cpu.so");
    CHECK(manifest.abi_major == 1);
    CHECK(manifest.abi_minor == 0);
    CHECK(manifest.sha256 == kHash);
}

TEST_CASE("row 32: a manifest that is not one flat object with the known keys is refused") {
    CHECK(contains(refusal(""), "empty"));
    CHECK(contains(refusal("cpu"), "not an object"));
    CHECK(contains(refusal("[1, 2]"), "lists"));
    CHECK(refusal("{") != "");
    CHECK(contains(refusal(std::string("\x7f"
                                       "ELF\0\1",
                                       6)),
                   "not a text file"));
    CHECK(contains(refusal(with("\"0.1\"", "{\"a\": 1}")), "objects inside"));
    CHECK(contains(refusal(with("\"0.1\"", "[]")), "lists"));
    CHECK(contains(refusal(with("\"0.1\"", "")), "missing"));
    CHECK(contains(refusal(with("\"version\"", "\"name\"")), "twice: name"));
    CHECK(contains(refusal(with("\"version\"", "\"verzion\"")), "version is missing"));
    CHECK(contains(refusal(with("{", "{\"color\": 1, ")), "unknown key color"));
    CHECK(refusal(good_text() + "\n---\n" + good_text()) != "");
}

TEST_CASE("row 32: anchors, aliases, tags and deep nesting are refused") {
    CHECK(contains(refusal(with("\"0.1\"", "&a \"0.1\"")), "anchors"));
    CHECK(contains(refusal(with("\"0.1\"", "*a")), "manifest:"));
    CHECK(contains(refusal(with("\"0.1\"", "!!str \"0.1\"")), "tags"));
    CHECK(contains(refusal(std::string(60000, '[')), "lists"));
    CHECK(contains(refusal(std::string(60000, '{')), "manifest:"));
}

TEST_CASE("row 32: every value is checked") {
    CHECK(contains(refusal(with("\"cpu\"", "\"../cpu\"")), "name is"));
    CHECK(contains(refusal(with("\"cpu\"", "\"" + std::string(33, 'a') + "\"")), "name is"));
    CHECK(contains(refusal(with("\"cpu.so\"", "\"../cpu.so\"")), "library is"));
    CHECK(contains(refusal(with("\"cpu.so\"", "\"/lib/cpu.so\"")), "library is"));
    CHECK(contains(refusal(with("\"cpu.so\"", "\"..\"")), "library is"));
    CHECK(contains(refusal(with("\"abi_major\": 1", "\"abi_major\": 1.5")), "abi_major is"));
    CHECK(contains(refusal(with("\"abi_major\": 1", "\"abi_major\": -1")), "abi_major is"));
    CHECK(
        contains(refusal(with("\"abi_major\": 1", "\"abi_major\": 99999999999")), "abi_major is"));
    CHECK(contains(refusal(with(kHash, kHash + "0")), "sha256 is"));
    CHECK(contains(refusal(with(kHash, std::string(64, 'A'))), "sha256 is"));
}

TEST_CASE("row 31: the locale makes no difference") {
    const std::string before = std::setlocale(LC_ALL, nullptr);
    for (const char* locale : {"de_DE.UTF-8", "de_DE", "C"}) {
        std::setlocale(LC_ALL, locale);
        CHECK(parse(good_text()).abi_major == 1);
    }
    std::setlocale(LC_ALL, before.c_str());
}
