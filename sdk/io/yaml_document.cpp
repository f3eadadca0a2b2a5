// A YAML file from a user as a plain tree with line numbers.
#include "sdk/io/yaml_document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::size_t kDeepestNesting = 16;

struct Refusal {
    int line;
    std::string message;
};

// Builds the tree from the parser's events, so that a refused construct ends the parsing before it
// costs anything.
class TreeBuilder : public YAML::EventHandler {
  public:
    explicit TreeBuilder(std::size_t max_keys) : max_keys_(max_keys) {}

    YamlNode take_root() { return std::move(root_); }

    void OnDocumentStart(const YAML::Mark&) override {}
    void OnDocumentEnd() override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        add(mark, anchor, YamlNode::Kind::kNull, {});
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
        throw Refusal{mark.line + 1, "aliases (*name) are not accepted; write the value out."};
    }
    void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  const std::string& value) override {
        Level* level = levels_.empty() ? nullptr : &levels_.back();
        if (level != nullptr && level->is_map && !level->has_key) {
            refuse_anchor(mark, anchor);
            take_key(*level, mark, value);
        } else {
            add(mark, anchor, YamlNode::Kind::kScalar, value);
        }
    }
    void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open(mark, anchor, YamlNode::Kind::kSequence);
    }
    void OnSequenceEnd() override { close(); }
    void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        open(mark, anchor, YamlNode::Kind::kMap);
    }
    void OnMapEnd() override { close(); }

  private:
    struct Level {
        YamlNode node;
        bool is_map;
        bool has_key = false;
        std::string key;
        int key_line = 0;
    };

    static void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
        if (anchor != 0)
            throw Refusal{mark.line + 1, "anchors (&name) are not accepted; write the value out."};
    }

    void take_key(Level& level, const YAML::Mark& mark, const std::string& key) const {
        if (const YamlEntry* earlier = level.node.find(key)) {
            throw Refusal{mark.line + 1,
                          key + ": the key stands here again; it was first given in line " +
                              std::to_string(earlier->line) + "."};
        }
        if (level.node.entries.size() >= max_keys_) {
            throw Refusal{mark.line + 1, "more than " + std::to_string(max_keys_) +
                                             " keys, the most that is read."};
        }
        level.has_key = true;
        level.key = key;
        level.key_line = mark.line + 1;
    }

    void add(const YAML::Mark& mark, YAML::anchor_t anchor, YamlNode::Kind kind,
             const std::string& value) {
        refuse_anchor(mark, anchor);
        YamlNode node;
        node.kind = kind;
        node.line = mark.line + 1;
        node.scalar = value;
        attach(std::move(node));
    }

    void open(const YAML::Mark& mark, YAML::anchor_t anchor, YamlNode::Kind kind) {
        refuse_anchor(mark, anchor);
        if (levels_.size() >= kDeepestNesting) {
            throw Refusal{mark.line + 1, "nested deeper than 16 levels, the most that is read."};
        }
        if (!levels_.empty() && levels_.back().is_map && !levels_.back().has_key) {
            throw Refusal{mark.line + 1, "a key must be a plain word."};
        }
        Level level{{}, kind == YamlNode::Kind::kMap, false, {}, 0};
        level.node.kind = kind;
        level.node.line = mark.line + 1;
        levels_.push_back(std::move(level));
    }

    void close() {
        YamlNode node = std::move(levels_.back().node);
        levels_.pop_back();
        attach(std::move(node));
    }

    void attach(YamlNode node) {
        if (levels_.empty()) {
            root_ = std::move(node);
            return;
        }
        Level& level = levels_.back();
        if (!level.is_map) {
            level.node.items.push_back(std::move(node));
        } else if (level.has_key) {
            level.node.entries.push_back({std::move(level.key), level.key_line, std::move(node)});
            level.has_key = false;
        } else {
            throw Refusal{node.line, "a key must be a plain word."};
        }
    }

    std::size_t max_keys_;
    YamlNode root_;
    std::vector<Level> levels_;
};

}  // namespace

const YamlEntry* YamlNode::find(const std::string& key) const {
    const auto found = std::find_if(entries.begin(), entries.end(),
                                    [&](const YamlEntry& entry) { return entry.key == key; });
    return found == entries.end() ? nullptr : &*found;
}

YamlDocument YamlDocument::load(const std::filesystem::path& path, ExitCode code,
                                const YamlLimits& limits) {
    YamlDocument document;
    document.path_ = path.string();
    document.code_ = code;
    const std::string text = read_text_file(path, limits.bytes, code);

    try {
        std::istringstream stream(text);
        YAML::Parser parser(stream);
        TreeBuilder builder(limits.keys);
        if (parser.HandleNextDocument(builder)) document.root_ = builder.take_root();
        TreeBuilder second(limits.keys);
        if (parser.HandleNextDocument(second))
            document.fail(1, {}, "the file holds more than one YAML document.");
    } catch (const Refusal& refusal) {
        document.fail(refusal.line, {}, refusal.message);
    } catch (const YAML::Exception& error) {
        document.fail(error.mark.is_null() ? 1 : error.mark.line + 1, {},
                      "not valid YAML: " + error.msg + ".");
    }
    if (document.root_.kind == YamlNode::Kind::kNull) document.fail(1, {}, "the file is empty.");
    const bool is_sequence = document.root_.kind == YamlNode::Kind::kSequence;
    if (document.root_.kind != YamlNode::Kind::kMap && !(is_sequence && limits.may_be_sequence)) {
        document.fail(document.root_.line, {}, "lines of the form `key: value` were expected.");
    }
    return document;
}

void YamlDocument::fail(int line, const std::string& key, const std::string& message) const {
    throw CliError(code_, path_ + ":" + std::to_string(line) + ": " +
                              (key.empty() ? "" : key + ": ") + message);
}

void YamlDocument::require_known_keys(const YamlNode& map, const std::vector<std::string>& known,
                                      const std::string& where) const {
    for (const YamlEntry& entry : map.entries) {
        if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
        const std::string nearest = nearest_name(entry.key, known);
        fail(entry.line, where + entry.key.substr(0, 64),
             nearest.empty() ? std::string("this key is not known.")
                             : "this key is not known; the nearest that is: " + nearest + ".");
    }
}

double YamlDocument::number(const YamlNode& node, const std::string& key) const {
    const std::string shown = node.scalar.substr(0, 40);
    if (node.kind != YamlNode::Kind::kScalar) fail(node.line, key, "a number was expected.");
    const std::optional<double> value = parse_double(node.scalar);
    if (!value) fail(node.line, key, "'" + shown + "' is not a number (the decimal point is '.').");
    if (!std::isfinite(*value)) fail(node.line, key, "'" + shown + "' is not finite.");
    return *value;
}

int YamlDocument::integer(const YamlNode& node, const std::string& key, int low, int high) const {
    const std::optional<std::int64_t> value =
        node.kind == YamlNode::Kind::kScalar ? parse_integer(node.scalar) : std::nullopt;
    if (!value || *value < low || *value > high) {
        fail(node.line, key,
             "a whole number from " + std::to_string(low) + " to " + std::to_string(high) +
                 " was expected" +
                 (node.scalar.empty() ? "." : ", not '" + node.scalar.substr(0, 40) + "'."));
    }
    return static_cast<int>(*value);
}

}  // namespace defrec::cli
