// A YAML file from a user as a plain tree with line numbers. Stricter than YAML: no anchors,
// aliases, duplicate keys or second documents, at most 16 levels and what YamlLimits say. Values
// stay text; numbers are read with parse_double.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

struct YamlEntry;

struct YamlNode {
    enum class Kind { kNull, kScalar, kSequence, kMap };
    Kind kind = Kind::kNull;
    int line = 1;                    // 1-based
    std::string scalar;              // kScalar
    std::vector<YamlNode> items;     // kSequence
    std::vector<YamlEntry> entries;  // kMap, in the file's order

    const YamlEntry* find(const std::string& key) const;
};

struct YamlEntry {
    std::string key;
    int line = 1;
    YamlNode value;
};

// What a kind of file may hold.
struct YamlLimits {
    std::size_t bytes = 1'000'000;
    std::size_t keys = 500;        // of one map; each key is compared with all before it
    bool may_be_sequence = false;  // else the whole file is a map
};

// One file, and the exit code with which the program ends when it is wrong.
class YamlDocument {
  public:
    // Throws CliError(code) naming file, line and reason for every file that is not a well-formed
    // map within the limits.
    static YamlDocument load(const std::filesystem::path& path, ExitCode code,
                             const YamlLimits& limits = {});

    const YamlNode& root() const { return root_; }
    const std::string& path() const { return path_; }

    // Throws CliError: "path:line: key: error message". An empty key is left out.
    [[noreturn]] void fail(int line, const std::string& key, const std::string& message) const;

    // Throws for a key of `map` that is not in `known`, naming the nearest that is. `where` goes
    // before the key ("M1.").
    void require_known_keys(const YamlNode& map, const std::vector<std::string>& known,
                            const std::string& where = {}) const;

    // The scalar as a number; throws when it is none. Not finite numbers throw too.
    double number(const YamlNode& node, const std::string& key) const;
    // The scalar as an integer within [low, high].
    int integer(const YamlNode& node, const std::string& key, int low, int high) const;

  private:
    std::string path_;
    ExitCode code_ = ExitCode::kInput;
    YamlNode root_;
};

}  // namespace defrec::cli
