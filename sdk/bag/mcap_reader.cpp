// See mcap_reader.hpp.
#include "sdk/bag/mcap_reader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "sdk/bag/chunk_compression.hpp"
#include "sdk/bag/crc32.hpp"
#include "sdk/base/os/stdio_file.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Buffer = std::vector<unsigned char>;

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::uint64_t kHeadBytes = 9, kFooterBytes = 20;
// A chunk, packed or not, or a message outside of chunks: both views of the largest images in
// colour.
constexpr std::uint64_t kLargestChunk = std::uint64_t{512} << 20;
// A schema is a message's definition as text.
constexpr std::uint64_t kLargestRecord = std::uint64_t{16} << 20;
constexpr std::size_t kLongestName = 4096;

enum Opcode : std::uint8_t {
    kFooter = 0x02,
    kSchema = 0x03,
    kChannel = 0x04,
    kMessage = 0x05,
    kChunk = 0x06,
    kStatistics = 0x0B,
    kDataEnd = 0x0F,
};

struct RecordHead {
    std::uint8_t opcode = 0;
    std::uint64_t size = 0;    // of what follows
    std::uint64_t offset = 0;  // of the head
};

// Records of a file, one after the other.
class RecordFile {
  public:
    explicit RecordFile(std::filesystem::path path)
        : path_(std::move(path)), file_(open_file(path_), &std::fclose) {
        if (!file_) {
            const std::string reason = std::generic_category().message(errno);
            throw CliError(ExitCode::kInput,
                           path_.string() + ": the file cannot be opened (" + reason + ").");
        }
        std::array<unsigned char, kMagic.size()> magic{};
        if (std::fseek(file_.get(), 0, SEEK_END) == 0) size_ = tell();
        std::rewind(file_.get());
        if (!take(magic.data(), magic.size()) || magic != kMagic)
            throw CliError(ExitCode::kInput,
                           path_.string() + ": this is not an MCAP file; it does not begin as one" +
                               (size_ == 0 ? ", and is empty." : "."));
    }

    const std::filesystem::path& path() const { return path_; }
    std::uint64_t size() const { return size_; }
    std::uint64_t offset() const { return offset_; }
    // The checksum of all bytes that were taken since the beginning, or since seek().
    std::uint32_t crc() const { return crc_; }
    // The same, of those before the last head.
    std::uint32_t crc_before() const { return crc_before_; }

    bool seek(std::uint64_t offset) {
        crc_ = 0;
        offset_ = offset;
        return offset <= size_ && std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) == 0;
    }

    // Empty at the end of the file.
    std::optional<RecordHead> head() {
        crc_before_ = crc_;
        std::array<unsigned char, kHeadBytes> bytes{};
        const std::uint64_t offset = offset_;
        if (!take(bytes.data(), bytes.size())) return std::nullopt;
        ByteReader reader(bytes);
        const auto opcode = reader.number<std::uint8_t>();
        return RecordHead{opcode, reader.number<std::uint64_t>(), offset};
    }

    // False where the file has fewer bytes, of which none are taken then.
    bool read(std::uint64_t size, Buffer& bytes) {
        if (size > size_ - offset_) return false;
        bytes.resize(static_cast<std::size_t>(size));
        return take(bytes.data(), bytes.size());
    }

    bool skip(std::uint64_t size) {
        if (size > size_ - offset_) return false;
        std::array<unsigned char, 1 << 16> block{};
        while (size > 0) {
            const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(size, block.size()));
            if (!take(block.data(), step)) return false;
            size -= step;
        }
        return true;
    }

  private:
    std::uint64_t tell() const {
        const long end = std::ftell(file_.get());
        return end > 0 ? static_cast<std::uint64_t>(end) : 0;
    }

    bool take(unsigned char* bytes, std::size_t count) {
        if (std::fread(bytes, 1, count, file_.get()) != count) return false;
        offset_ += count;
        crc_ = crc32({bytes, count}, crc_);
        return true;
    }

    const std::filesystem::path path_;
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
    std::uint64_t size_ = 0, offset_ = 0;
    std::uint32_t crc_ = 0, crc_before_ = 0;
};

// Which channel carries which topic.
class Channels {
  public:
    // False where the record is not as the format has it.
    bool add_schema(ByteView record) {
        ByteReader reader(record);
        const auto id = reader.number<std::uint16_t>();
        const std::string_view name = reader.text();
        if (reader.has_failed() || name.size() > kLongestName) return false;
        if (id != 0) types_.insert_or_assign(id, std::string(name));
        return true;
    }
    bool add_channel(ByteView record) {
        ByteReader reader(record);
        const auto id = reader.number<std::uint16_t>(), schema = reader.number<std::uint16_t>();
        const std::string_view name = reader.text(), encoding = reader.text();
        if (reader.has_failed() || std::max(name.size(), encoding.size()) > kLongestName)
            return false;
        const auto type = types_.find(schema);
        BagTopic topic{std::string(name), type == types_.end() ? "" : type->second,
                       std::string(encoding)};
        const auto known = topics_.find(id);
        if (known != topics_.end()) return known->second.is_same(topic);
        topics_.emplace(id, std::move(topic));
        return true;
    }
    const BagTopic* find(std::uint16_t id) const {
        const auto topic = topics_.find(id);
        return topic == topics_.end() ? nullptr : &topic->second;
    }
    const std::map<std::uint16_t, BagTopic>& topics() const { return topics_; }

  private:
    std::map<std::uint16_t, std::string> types_;
    std::map<std::uint16_t, BagTopic> topics_;
};

struct Summary {
    std::uint64_t begin = 0, end = 0;  // bytes of the file; the footer begins at the end
    std::uint32_t crc = 0;             // 0: there is none
};

// Empty where the file has no summary, or was cut off.
std::optional<Summary> find_summary(RecordFile& file) {
    const std::uint64_t bytes_of_end = kHeadBytes + kFooterBytes + kMagic.size();
    if (file.size() < kMagic.size() + bytes_of_end || !file.seek(file.size() - bytes_of_end))
        return std::nullopt;
    Summary summary;
    summary.end = file.offset();
    Buffer bytes;
    const std::optional<RecordHead> footer = file.head();
    if (!footer || footer->opcode != kFooter || footer->size != kFooterBytes ||
        !file.read(kFooterBytes, bytes))
        return std::nullopt;
    ByteReader reader(bytes);
    summary.begin = reader.number<std::uint64_t>();
    reader.bytes(sizeof(std::uint64_t));
    summary.crc = reader.number<std::uint32_t>();
    const bool is_there = summary.begin >= kMagic.size() && summary.begin < summary.end;
    return is_there ? std::optional(summary) : std::nullopt;
}

using Counts = std::map<std::uint16_t, std::uint64_t>;  // of messages, by channels

// record: statistics. False where they are damaged.
bool read_counts(ByteView record, Counts& counts) {
    constexpr std::uint64_t kBeforeCounts = 8 + 2 + 4 * 4 + 2 * 8;
    ByteReader reader(record);
    reader.bytes(kBeforeCounts);
    ByteReader map(reader.bytes(reader.number<std::uint32_t>()));
    while (!map.left().empty() && !map.has_failed()) {
        const auto id = map.number<std::uint16_t>();
        counts[id] = map.number<std::uint64_t>();
    }
    return !reader.has_failed() && !map.has_failed();
}

// The topics of the summary; empty where it does not count the messages of channels, or is damaged.
std::optional<std::vector<BagTopic>> summarised_topics(RecordFile& file) {
    const std::optional<Summary> summary = find_summary(file);
    if (!summary || !file.seek(summary->begin)) return std::nullopt;
    Channels channels;
    Counts counts;
    Buffer bytes;
    while (file.offset() < summary->end) {
        const std::optional<RecordHead> head = file.head();
        if (!head || head->size > summary->end - std::min(file.offset(), summary->end))
            return std::nullopt;
        const bool is_used =
            head->opcode == kSchema || head->opcode == kChannel || head->opcode == kStatistics;
        if (!is_used && !file.skip(head->size)) return std::nullopt;
        if (!is_used) continue;
        if (head->size > kLargestRecord || !file.read(head->size, bytes)) return std::nullopt;
        const bool is_whole = head->opcode == kSchema    ? channels.add_schema(bytes)
                              : head->opcode == kChannel ? channels.add_channel(bytes)
                                                         : read_counts(bytes, counts);
        if (!is_whole) return std::nullopt;
    }
    if (file.offset() != summary->end || counts.empty()) return std::nullopt;
    // The checksum is of the footer's first numbers, too.
    if (summary->crc != 0 &&
        (!file.skip(kHeadBytes + 2 * sizeof(std::uint64_t)) || file.crc() != summary->crc))
        return std::nullopt;
    std::vector<BagTopic> topics;
    for (const auto& [id, topic] : channels.topics()) {
        BagTopic counted = topic;
        counted.messages = counts[id];
        add_topic(counted, topics);
    }
    return topics;
}

}  // namespace

struct McapReader::Impl {
    explicit Impl(const std::filesystem::path& path) : file(path) {}

    RecordFile file;
    Channels channels;
    Buffer record, chunk;
    ByteReader chunk_left{ByteView()};
    std::uint64_t chunk_at = 0;
    std::string fault;
    bool has_ended = false;

    bool fail(std::uint64_t offset, const std::string& what) {
        fault = file.path().string() + ": " + what + " (Byte " + std::to_string(offset) + " of " +
                std::to_string(file.size()) + ".)";
        return false;
    }
    bool fail_cut(std::uint64_t offset) {
        return fail(offset,
                    "the file is cut off: it ends before the end of its data. What comes before "
                    "was read.");
    }

    // Takes a record in as far as messages need it; true for a message.
    bool take(std::uint8_t opcode, ByteView content, std::uint64_t offset, BagMessage& message) {
        if (opcode == kSchema && !channels.add_schema(content))
            return fail(offset, "a schema is damaged.");
        if (opcode == kChannel && !channels.add_channel(content))
            return fail(offset, "a channel is damaged, or is there twice and differs.");
        if (opcode != kMessage) return false;
        constexpr std::uint64_t kAfterId = 4 + 8 + 8;
        ByteReader reader(content);
        const auto id = reader.number<std::uint16_t>();
        reader.bytes(kAfterId);
        if (reader.has_failed()) return fail(offset, "a message is damaged.");
        message.topic = channels.find(id);
        message.data = reader.left();
        return message.topic != nullptr ||
               fail(offset, "a message is of channel " + std::to_string(id) +
                                ", which the file does not have before it.");
    }

    bool next_of_chunk(BagMessage& message) {
        while (!chunk_left.left().empty() && fault.empty()) {
            const auto opcode = chunk_left.number<std::uint8_t>();
            const ByteView content = chunk_left.bytes(chunk_left.number<std::uint64_t>());
            if (chunk_left.has_failed()) {
                chunk_left = ByteReader(ByteView());
                return fail(chunk_at, "a chunk is damaged: a record in it is longer than it is.");
            }
            if (take(opcode, content, chunk_at, message)) return true;
        }
        return false;
    }

    // record: of a chunk.
    void open_chunk(std::uint64_t offset) {
        chunk_at = offset;
        ByteReader reader(record);
        constexpr std::uint64_t kTimes = 2 * 8;
        reader.bytes(kTimes);
        const auto size = reader.number<std::uint64_t>();
        const auto crc = reader.number<std::uint32_t>();
        const std::string_view compression = reader.text();
        const ByteView packed = reader.bytes(reader.number<std::uint64_t>());
        if (reader.has_failed()) {
            fail(offset, "a chunk is damaged.");
        } else if (size > kLargestChunk) {
            fail(offset, "a chunk claims " + std::to_string(size) + " bytes; at most " +
                             std::to_string(kLargestChunk) + " are read.");
        } else if (const std::string wrong =
                       unpack(compression, packed, static_cast<std::size_t>(size), chunk);
                   !wrong.empty()) {
            fail(offset, "a chunk " + wrong);
        } else if (crc != 0 && crc32(chunk) != crc) {
            fail(offset, "a chunk is damaged: its checksum differs.");
        } else {
            chunk_left = ByteReader(chunk);
        }
    }

    void end_data(const RecordHead& head) {
        has_ended = true;
        if (head.opcode != kDataEnd) return;
        const std::uint32_t actual = file.crc_before();
        if (!file.read(sizeof(std::uint32_t), record)) return;
        const auto crc = ByteReader(record).number<std::uint32_t>();
        if (crc != 0 && crc != actual)
            fail(head.offset,
                 "the file is damaged: the checksum of its data differs, and any image may be "
                 "wrong.");
    }

    // A record of the file; true for a message outside of chunks.
    bool next_record(BagMessage& message) {
        const std::uint64_t offset = file.offset();
        const std::optional<RecordHead> head = file.head();
        if (!head) return fail_cut(offset);
        if (head->opcode == 0) return fail(offset, "the file is damaged: this begins no record.");
        if (head->opcode == kFooter || head->opcode == kDataEnd) {
            end_data(*head);
            return false;
        }
        const bool is_large = head->opcode == kChunk || head->opcode == kMessage;
        const bool is_used = is_large || head->opcode == kSchema || head->opcode == kChannel;
        if (!is_used) return !file.skip(head->size) && fail_cut(offset);
        if (head->size > file.size() - file.offset()) return fail_cut(offset);
        const std::uint64_t most = is_large ? kLargestChunk : kLargestRecord;
        if (head->size > most)
            return fail(offset, "a record has " + std::to_string(head->size) + " bytes; at most " +
                                    std::to_string(most) + " are read.");
        if (!file.read(head->size, record)) return fail(offset, "the file cannot be read.");
        if (head->opcode != kChunk) return take(head->opcode, record, offset, message);
        open_chunk(offset);
        return false;
    }
};

McapReader::McapReader(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}

McapReader::~McapReader() = default;

const std::string& McapReader::fault() const { return impl_->fault; }

bool McapReader::next(BagMessage& message) {
    Impl& impl = *impl_;
    while (impl.fault.empty()) {
        if (impl.next_of_chunk(message)) return true;
        if (!impl.fault.empty() || impl.has_ended) return false;
        if (impl.next_record(message)) return true;
    }
    return false;
}

void add_topic(const BagTopic& topic, std::vector<BagTopic>& topics) {
    const auto known = std::find_if(topics.begin(), topics.end(),
                                    [&](const BagTopic& other) { return other.is_same(topic); });
    if (known == topics.end())
        topics.push_back(topic);
    else
        known->messages += topic.messages;
}

std::vector<BagTopic> topics_of_mcap(const std::filesystem::path& path) {
    RecordFile file(path);
    if (std::optional<std::vector<BagTopic>> topics = summarised_topics(file)) return *topics;
    McapReader reader(path);
    std::vector<BagTopic> topics;
    std::map<const BagTopic*, std::uint64_t> counts;
    BagMessage message;
    while (reader.next(message)) ++counts[message.topic];
    for (const auto& [topic, count] : counts) {
        BagTopic counted = *topic;
        counted.messages = count;
        add_topic(counted, topics);
    }
    std::sort(topics.begin(), topics.end(),
              [](const BagTopic& a, const BagTopic& b) { return a.name < b.name; });
    return topics;
}

}  // namespace defrec::cli
