// Bags in SQLite files, as rosbag2 writes them, and as they arrive.
#include "sdk/bag/sqlite_reader.hpp"

#include <doctest/doctest.h>

#include <fstream>

#include "sdk/bag/bag.hpp"
#include "sdk/bag/test_sqlite_bag.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

// Topics of images: 1 is the left one, 2 the right one.
constexpr char kTopics[] =
    "INSERT INTO topics VALUES(1, '/left', 'sensor_msgs/msg/Image', 'cdr', '', '');"
    "INSERT INTO topics VALUES(2, '/right', 'sensor_msgs/msg/Image', 'cdr', '', '');";

void write_bag(const fs::path& path) {
    SqliteBag bag(path);
    bag.run(kTopics);
    bag.add(1, 20, "a");
    bag.add(2, 10, std::string("b\0c", 3));  // came later, and is of an earlier time
    bag.add(1, 30, std::string(100'000, 'd'));
    bag.add(2, 40, "");
}

// "topic:data " of each, and the fault.
std::string all_of(const std::string& path) {
    const std::unique_ptr<BagReader> reader = open_sqlite_bag(path);
    BagMessage message;
    std::string all;
    while (reader->next(message))
        all.append(message.topic->name)
            .append(":")
            .append(message.data.begin(), message.data.end())
            .append(" ");
    CHECK_FALSE(reader->next(message));
    return all + reader->fault();
}

std::string refusal(const std::string& path) {
    return refusal_of([&] { open_sqlite_bag(path); });
}

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
        names.push_back(entry.path().filename().string());
    return names;
}

}  // namespace

TEST_CASE("messages of an SQLite bag in the order in which they came, bytes as they are") {
    const TestFolder folder;
    const std::string path = folder / "a bag?#%41.db3";
    write_bag(path);
    CHECK(all_of(path) ==
          std::string("/left:a /right:b\0c /left:", 25) + std::string(100'000, 'd') + " /right: ");
    const auto topics = topics_of_sqlite_bag(path);
    REQUIRE(topics.size() == 2);
    CHECK(topics[0].name == "/left");
    CHECK(topics[0].type == "sensor_msgs/msg/Image");
    CHECK(topics[0].encoding == "cdr");
    CHECK(topics[0].messages == 2);
    CHECK(topics[1].messages == 2);
    // Nothing is written beside it.
    CHECK(names_in(folder.path()).size() == 1);
}

TEST_CASE("a folder with SQLite files is a bag, with its metadata and without") {
    const TestFolder folder;
    write_bag(folder / "rec_0.db3");
    write_bag(folder / "rec_1.db3");
    const auto count = [&] {
        BagMessages messages(files_of_bag(folder.path()));
        BagMessage message;
        int found = 0;
        while (messages.next(message)) ++found;
        CHECK(messages.fault().empty());
        return found;
    };
    CHECK(count() == 8);
    CHECK(topics_of_bag(files_of_bag(folder.path())).front().messages == 4);
    folder.write("metadata.yaml",
                 "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
                 "  compression_mode: \"\"\n  relative_file_paths:\n    - rec_1.db3\n");
    CHECK(count() == 4);
}

TEST_CASE("what a recorder that was killed has left in its log is read") {
    const TestFolder folder;
    const std::string path = folder / "a.db3", copy = folder / "b.db3";
    {
        SqliteBag bag(path);
        bag.run(kTopics);
        bag.add(1, 1, "x");
        // As it stands on the disk while the recorder runs.
        for (const char* end : {"", "-wal"}) fs::copy_file(path + end, copy + end);
    }
    CHECK(all_of(copy) == "/left:x ");
}

TEST_CASE("row 210: what is no SQLite bag is refused, with the reason") {
    const TestFolder folder;
    CHECK_SAYS(refusal(folder / "none.db3"), "no such file");
    CHECK_SAYS(refusal(folder.write("text.db3", "a text that is long enough to be a header")),
               "not a bag that rosbag2 wrote in SQLite (file is not a database)");
    CHECK_SAYS(refusal(folder.write("empty.db3", "")), "no such table: topics");
    { const SqliteBag other(folder / "other.db3", "CREATE TABLE cars(id INTEGER PRIMARY KEY)"); }
    CHECK_SAYS(refusal(folder / "other.db3"), "no such table: topics");
    // A view may compute what it likes.
    {
        const SqliteBag bag(folder / "view.db3",
                            "CREATE VIEW topics AS SELECT 1 AS id, '' AS name, '' AS type, '' AS "
                            "serialization_format; CREATE TABLE messages(id, topic_id, data)");
    }
    CHECK_SAYS(refusal(folder / "view.db3"), "not a bag");
    {
        const SqliteBag bag(folder / "column.db3",
                            "CREATE TABLE topics(id, name, type, serialization_format);"
                            "CREATE TABLE messages(id, topic_id)");
    }
    CHECK_SAYS(refusal(folder / "column.db3"), "no such column: data");
}

TEST_CASE("row 210: an SQLite bag that is cut off is refused, a damaged one read until there") {
    const TestFolder folder;
    const std::string path = folder / "a.db3";
    write_bag(path);
    const std::string bytes = TestFolder::read(path);
    CHECK_SAYS(refusal(folder.write("cut.db3", bytes.substr(0, bytes.size() - 50'000))),
               "cut.db3: the file is cut off or damaged (database disk image is malformed)");
    // Pages of the longest message, of which each begins with the number of the next one.
    constexpr std::size_t kPage = 4096;
    std::string broken = bytes;
    for (std::size_t page = 0; page + kPage <= bytes.size(); page += kPage)
        if (bytes.compare(page + 4, kPage - 4, std::string(kPage - 4, 'd')) == 0)
            broken.replace(page, 4, "\xff\xff\xff\xff");
    CHECK(broken != bytes);
    CHECK(all_of(folder.write("broken.db3", broken)) ==
          std::string("/left:a /right:b\0c ", 19) + (folder / "broken.db3") +
              ": the file is cut off or damaged: after message 2 SQLite says database disk image "
              "is malformed.");
    std::string noise = bytes;
    for (std::size_t i = kPage; i < noise.size(); i += 7) noise[i] = static_cast<char>(i * 31);
    CHECK_SAYS(refusal_of([&] { all_of(folder.write("noise.db3", noise)); }), "noise.db3");
    {
        SqliteBag bag(folder / "topic.db3");
        bag.run(kTopics);
        bag.add(1, 1, "x");
        bag.add(7, 2, "y");
    }
    CHECK_SAYS(all_of(folder / "topic.db3"),
               "the file is damaged: message 2 has a topic that there is not");
}

TEST_CASE("row 210: an SQLite bag that claims more than its bytes can hold is refused") {
    const TestFolder folder;
    {
        SqliteBag bag(folder / "made.db3",
                      "CREATE TABLE topics(id, name, type, serialization_format);"
                      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id,"
                      " data AS (zeroblob(100000)))");
        bag.run("INSERT INTO topics VALUES(1, '/left', 'sensor_msgs/msg/Image', 'cdr')");
        bag.run("INSERT INTO messages VALUES(1, 1)");
    }
    CHECK_SAYS(all_of(folder / "made.db3"),
               "the file is damaged: it has messages that are larger than itself");
}
