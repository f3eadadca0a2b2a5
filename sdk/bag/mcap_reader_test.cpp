// Reading MCAP files, whole, cut off and damaged.
#include "sdk/bag/mcap_reader.hpp"

#include <doctest/doctest.h>

#include <random>

#include "sdk/bag/crc32.hpp"
#include "sdk/bag/test_bag.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

struct Read {
    std::vector<std::string> messages;  // "topic=data"
    std::string fault;
};

Read read(const std::string& path) {
    McapReader reader(path);
    Read all;
    BagMessage message;
    while (reader.next(message))
        all.messages.push_back(message.topic->name + "=" +
                               std::string(message.data.begin(), message.data.end()));
    all.fault = reader.fault();
    return all;
}

// Five messages of two topics.
std::string file_of(const McapWriter::Options& options) {
    McapWriter writer(options);
    const auto a = writer.add_channel("/a", std::string(kImageType));
    const auto b = writer.add_channel("/b", "std_msgs/msg/String", "json");
    writer.add(a, "one");
    writer.add(b, "two");
    writer.add(a, std::string(1'200'000, 'x'));
    writer.add(a, "");
    writer.add(b, "five");
    return writer.finish();
}

const std::vector<std::string> kMessages = {"/a=one", "/b=two", "/a=" + std::string(1'200'000, 'x'),
                                            "/a=", "/b=five"};

// The offset of the n-th record of a kind.
std::size_t find_record(const std::string& text, char opcode, int n = 0) {
    for (std::size_t at = 8; at + 9 <= text.size();) {
        if (text[at] == opcode && n-- == 0) return at;
        at +=
            9 +
            ByteReader(bytes_of(std::string_view(text).substr(at + 1, 8))).number<std::uint64_t>();
    }
    throw std::logic_error("there is no such record");
}

}  // namespace

TEST_CASE("the checksum is zlib's") {
    CHECK(crc32({}) == 0);
    CHECK(crc32(bytes_of("123456789")) == 0xCBF43926);
    const std::string text = "The quick brown fox jumps over the lazy dog";
    CHECK(crc32(bytes_of(text)) == 0x414FA339);
    for (std::size_t i = 0; i <= text.size(); ++i)
        CHECK(crc32(bytes_of(text.substr(i)), crc32(bytes_of(text.substr(0, i)))) == 0x414FA339);
}

TEST_CASE("messages come in their order, whatever chunks they are in") {
    const TestFolder folder;
    for (const std::string& compression : compressions())
        for (const std::size_t messages : {1, 2, 100})
            for (const bool is_checked : {false, true}) {
                CAPTURE(compression);
                CAPTURE(messages);
                McapWriter::Options options;
                options.compression = compression;
                options.messages = messages;
                options.has_summary = options.has_crc = is_checked;
                const Read all = read(folder.write("bag.mcap", file_of(options)));
                CHECK(all.messages == kMessages);
                CHECK(all.fault == "");
            }
    McapWriter::Options options;
    options.messages = 0;
    const Read all = read(folder.write("bag.mcap", file_of(options)));
    CHECK(all.messages == kMessages);
    CHECK(all.fault == "");
}

TEST_CASE("topics are told by the summary, and without one by all messages") {
    const TestFolder folder;
    for (const bool has_summary : {false, true})
        for (const bool is_cut : {false, true}) {
            McapWriter::Options options;
            options.has_summary = has_summary;
            std::string text = file_of(options);
            if (is_cut) text.resize(find_record(text, 0x06, 2));
            const auto topics = topics_of_mcap(folder.write("bag.mcap", text));
            REQUIRE(topics.size() == 2);
            CHECK(topics[0].name == "/a");
            CHECK(topics[0].type == kImageType);
            CHECK(topics[0].encoding == "cdr");
            CHECK(topics[0].messages == 3);
            CHECK(topics[1].encoding == "json");
            CHECK(topics[1].messages == (is_cut ? 1 : 2));
        }
    // The summary is believed: it is not what a pass over the messages gives.
    std::string text = file_of({});
    const std::size_t statistics = find_record(text, 0x0B);
    text[statistics + 9 + 42 + 4 + 2] = 77;
    CHECK(topics_of_mcap(folder.write("bag.mcap", text))[0].messages == 3);  // its checksum differs
    McapWriter::Options unchecked;
    unchecked.has_crc = false;
    text = file_of(unchecked);
    text[find_record(text, 0x0B) + 9 + 42 + 4 + 2] = 77;
    CHECK(topics_of_mcap(folder.write("bag.mcap", text))[0].messages == 77);
}

TEST_CASE("row 198: a file that is cut off gives what comes before, and says so") {
    const TestFolder folder;
    for (const std::string& compression : compressions()) {
        McapWriter::Options options;
        options.compression = compression;
        const std::string text = file_of(options);
        const std::size_t second = find_record(text, 0x06, 1), third = find_record(text, 0x06, 2);
        for (const auto& [size, count] :
             {std::pair(second, 2), std::pair(second + 1, 2), std::pair(third - 40, 2),
              std::pair(third, 4), std::pair(third + 30, 4), std::pair(text.size() - 8, 5)}) {
            CAPTURE(size);
            const Read all = read(folder.write("bag.mcap", text.substr(0, size)));
            CHECK(all.messages.size() == static_cast<std::size_t>(count));
            if (count == 5)
                CHECK(all.fault == "");  // its data are whole
            else
                CHECK_SAYS(all.fault, "bag.mcap: the file is cut off");
        }
    }
    CHECK_SAYS(refusal_of([&] { read(folder.write("bag.mcap", "")); }), "and is empty");
    CHECK_SAYS(refusal_of([&] { read(folder.write("bag.mcap", "ftypmp42 and more")); }),
               "not an MCAP file");
    CHECK_SAYS(refusal_of([&] { read(folder / "none.mcap"); }), "No such file");
}

TEST_CASE("row 198: damage is found by checksums") {
    const TestFolder folder;
    const auto with_changed = [&](std::string text, std::size_t at) {
        text[at] = static_cast<char>(text[at] ^ 1);
        return read(folder.write("bag.mcap", text));
    };
    const std::string text = file_of({});
    const std::size_t second = find_record(text, 0x06, 1);
    const Read chunk = with_changed(text, second + 1'000'000);
    CHECK(chunk.messages.size() == 2);
    CHECK_SAYS(chunk.fault, "a chunk is damaged: its checksum differs");
    const Read metadata = with_changed(text, find_record(text, 0x0C) + 50);
    CHECK(metadata.messages.size() == 5);
    CHECK_SAYS(metadata.fault, "the checksum of its data differs");
    for (const std::string& compression : compressions()) {
        if (compression.empty()) continue;
        McapWriter::Options options;
        options.compression = compression;
        options.has_crc = false;
        const std::string packed = file_of(options);
        // The first bytes of what is compressed.
        const std::size_t content =
            find_record(packed, 0x06) + 9 + 8 + 8 + 8 + 4 + 4 + options.compression.size() + 8;
        const Read all = with_changed(packed, content);
        CHECK(all.messages.empty());
        CHECK_SAYS(all.fault, "a chunk is damaged.");
    }
}

TEST_CASE("row 198: sizes that a file cannot have are refused before memory is taken") {
    const TestFolder folder;
    const std::string text = file_of({});
    const auto with_number = [&](std::size_t at, std::uint64_t value) {
        ByteWriter number;
        number.number(value);
        return read(folder.write("bag.mcap", std::string(text).replace(at, 8, number.text)));
    };
    const std::size_t chunk = find_record(text, 0x06);
    CHECK_SAYS(with_number(chunk + 1, 1ULL << 62).fault, "cut off");
    CHECK_SAYS(with_number(chunk + 9 + 16, 1ULL << 62).fault, "claims 4611686018427387904 bytes");
    CHECK_SAYS(with_number(chunk + 9 + 16, 1ULL << 28).fault, "does not unpack");
    // A record in the chunk.
    CHECK_SAYS(with_number(chunk + 9 + 16 + 8 + 4 + 4 + 8 + 1, 1ULL << 62).fault, "checksum");
    for (const std::string& compression : compressions()) {
        McapWriter::Options packed;
        packed.compression = compression;
        packed.has_crc = false;
        std::string claims = file_of(packed);
        ByteWriter number;
        number.number(std::uint64_t{1} << 28);
        claims.replace(find_record(claims, 0x06) + 9 + 16, 8, number.text);
        CHECK_SAYS(read(folder.write("bag.mcap", claims)).fault, "does not unpack");
    }
    McapWriter::Options other;
    other.compression = "brotli";
    CHECK_SAYS(read(folder.write("bag.mcap", file_of(other))).fault,
               "compressed by 'brotli'; none, lz4 and zstd");
}

TEST_CASE("channels that are not there, or differ, end the reading") {
    const TestFolder folder;
    McapWriter writer;
    const auto a = writer.add_channel("/a", "type");
    writer.add(a, "one");
    writer.add(77, "two");
    const Read all = read(folder.write("bag.mcap", writer.finish()));
    CHECK(all.messages.size() == 1);
    CHECK_SAYS(all.fault, "channel 77");
}

TEST_CASE("damaged files never crash") {
    const TestFolder folder;
    std::mt19937 random(45);
    std::size_t messages = 0;
    for (const std::string& compression : compressions()) {
        McapWriter writer({compression, 2, true, false});
        const auto a = writer.add_channel("/a", "type");
        for (int i = 0; i < 6; ++i) writer.add(a, "message " + std::to_string(i));
        const std::string whole = writer.finish();
        for (int i = 0; i < 300; ++i) {
            std::string text = whole;
            for (int flips = 1 + static_cast<int>(random() % 4); flips > 0; --flips)
                text[random() % text.size()] = static_cast<char>(random());
            const std::string path = folder.write("bag.mcap", text);
            try {
                messages += read(path).messages.size();
                static_cast<void>(topics_of_mcap(path));
            } catch (const CliError& error) {
                CHECK(error.code() == ExitCode::kInput);
            }
        }
    }
    CHECK(messages > 300);
    CHECK(messages < 300 * 6 * compressions().size());
}
