// See sqlite_reader.hpp. How files of others are opened: https://sqlite.org/security.html.
#include "sdk/bag/sqlite_reader.hpp"

#include <string>

#include "sdk/io/exit_code.hpp"

#ifdef DEFREC_WITH_SQLITE
#include <sqlite3.h>

#include <map>
#include <string_view>

#include "sdk/io/text.hpp"
#endif

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw CliError(ExitCode::kInput, path.string() + ": " + what);
}

#ifdef DEFREC_WITH_SQLITE

// Both views of the largest images in colour.
constexpr int kLargestMessage = 512 << 20;
constexpr int kLongestName = 4096;
// Bytes of a row beside what is in it.
constexpr std::uint64_t kLeastRow = 3;

using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

// "file:" with what has a meaning there escaped.
std::string uri_of(const fs::path& path, bool is_immutable) {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    std::string uri = "file:";
    for (const char c : fs::absolute(path).string()) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '?' || c == '#' || c == '%')
            uri.append("%").append(1, kDigits[byte >> 4]).append(1, kDigits[byte & 15]);
        else
            uri += c;
    }
    return uri + (is_immutable ? "?immutable=1" : "?mode=ro");
}

class Database {
  public:
    explicit Database(const fs::path& path) : path_(path), handle_(nullptr, &sqlite3_close) {
        std::error_code error;
        if (!fs::is_regular_file(path, error)) fail(path, "there is no such file.");
        // Without a log the file is whole, and SQLite need not lock it or write beside it.
        const bool has_log = fs::file_size(path.string() + "-wal", error) > 0 && !error;
        sqlite3* opened = nullptr;
        const int result =
            sqlite3_open_v2(uri_of(path, !has_log).c_str(), &opened,
                            SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
        handle_.reset(opened);
        if (result != SQLITE_OK) fail(path, "the file cannot be opened (" + message() + ").");
        sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kLargestMessage);
        sqlite3_limit(opened, SQLITE_LIMIT_ATTACHED, 0);
        for (const int option : {SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_ENABLE_TRIGGER,
                                 SQLITE_DBCONFIG_TRUSTED_SCHEMA})
            sqlite3_db_config(opened, option, 0, nullptr);
        sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
        for (const char* pragma : {"PRAGMA cell_size_check = ON", "PRAGMA mmap_size = 0"})
            sqlite3_exec(opened, pragma, nullptr, nullptr, nullptr);
    }

    // Throws CliError(kInput) where the file has not what is asked for.
    Statement ask(const char* query) {
        sqlite3_stmt* statement = nullptr;
        const int result = sqlite3_prepare_v2(handle_.get(), query, -1, &statement, nullptr);
        if (result == SQLITE_OK) return {statement, &sqlite3_finalize};
        if (result == SQLITE_CORRUPT)
            fail(path_, "the file is cut off or damaged (" + message() +
                            "). `sqlite3 FILE .recover` makes another one of what it still has.");
        fail(path_, "this is not a bag that rosbag2 wrote in SQLite (" + message() + ").");
    }

    // In SQLite's words.
    std::string message() const {
        return handle_ ? printable(std::string(sqlite3_errmsg(handle_.get())).substr(0, 200))
                       : "no memory";
    }
    const fs::path& path() const { return path_; }

    // How many bytes its pages have, also those that are in its log alone. Rows of a sound file
    // have no more together; one whose pages stand in it twice may have any number.
    std::uint64_t bytes() {
        std::uint64_t product = 1;
        for (const char* pragma : {"PRAGMA page_count", "PRAGMA page_size"}) {
            const Statement row = ask(pragma);
            product *= sqlite3_step(row.get()) == SQLITE_ROW
                           ? static_cast<std::uint64_t>(sqlite3_column_int64(row.get(), 0))
                           : 0;
        }
        return product;
    }

  private:
    fs::path path_;
    std::unique_ptr<sqlite3, int (*)(sqlite3*)> handle_;
};

std::string text_of(sqlite3_stmt* row, int column) {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
    const int size = sqlite3_column_bytes(row, column);
    return text != nullptr && size <= kLongestName
               ? std::string(text, static_cast<std::size_t>(size))
               : std::string();
}

using Topics = std::map<sqlite3_int64, BagTopic>;

class SqliteReader : public BagReader {
  public:
    explicit SqliteReader(const fs::path& path)
        : database_(path),
          bytes_(database_.bytes()),
          topics_(topics_of(database_)),
          messages_(database_.ask("SELECT topic_id, data FROM messages ORDER BY id")) {}

    bool next(BagMessage& message) override {
        if (is_at_end_) return false;
        const int result = sqlite3_step(messages_.get());
        is_at_end_ = result != SQLITE_ROW;
        if (result == SQLITE_DONE) return false;
        if (result != SQLITE_ROW) {
            fault_ = database_.path().string() +
                     ": the file is cut off or damaged: after message " + std::to_string(read_) +
                     " SQLite says " + database_.message() + ".";
            return false;
        }
        const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
        if (topic == topics_.end()) {
            is_at_end_ = true;
            fault_ = database_.path().string() + ": the file is damaged: message " +
                     std::to_string(read_ + 1) + " has a topic that there is not.";
            return false;
        }
        const void* data = sqlite3_column_blob(messages_.get(), 1);
        const int size = sqlite3_column_bytes(messages_.get(), 1);
        taken_ += kLeastRow + static_cast<std::uint64_t>(size);
        if (taken_ > bytes_) {
            is_at_end_ = true;
            fault_ = database_.path().string() +
                     ": the file is damaged: it has messages that are larger than itself.";
            return false;
        }
        message.topic = &topic->second;
        message.data = {static_cast<const unsigned char*>(data),
                        data != nullptr ? static_cast<std::size_t>(size) : 0};
        ++read_;
        return true;
    }
    const std::string& fault() const override { return fault_; }

    static Topics topics_of(Database& database) {
        const Statement rows =
            database.ask("SELECT id, name, type, serialization_format FROM topics");
        Topics topics;
        int result = SQLITE_ROW;
        std::uint64_t left = database.bytes() / kLeastRow;
        while (left-- > 0 && (result = sqlite3_step(rows.get())) == SQLITE_ROW)
            topics[sqlite3_column_int64(rows.get(), 0)] = {
                text_of(rows.get(), 1), text_of(rows.get(), 2), text_of(rows.get(), 3)};
        if (result == SQLITE_ROW)
            fail(database.path(), "the file is damaged: it has more topics than it has bytes for.");
        if (result != SQLITE_DONE)
            fail(database.path(), "the file is cut off or damaged (" + database.message() + ").");
        return topics;
    }

  private:
    Database database_;
    std::uint64_t bytes_;  // of the file
    Topics topics_;
    Statement messages_;
    std::uint64_t read_ = 0;
    std::uint64_t taken_ = 0;  // bytes of the rows that were read
    bool is_at_end_ = false;
    std::string fault_;
};

#else

[[noreturn]] void fail_without(const fs::path& path) {
    fail(path,
         "this build of defrec cannot read bags in SQLite files (Debian: libsqlite3-dev when "
         "it is built). `ros2 bag convert` writes it anew with storage_id mcap.");
}

#endif

}  // namespace

#ifdef DEFREC_WITH_SQLITE

std::unique_ptr<BagReader> open_sqlite_bag(const fs::path& path) {
    return std::make_unique<SqliteReader>(path);
}

std::vector<BagTopic> topics_of_sqlite_bag(const fs::path& path) {
    Database database(path);
    Topics topics = SqliteReader::topics_of(database);
    const Statement rows = database.ask("SELECT topic_id FROM messages");
    std::uint64_t left = database.bytes() / kLeastRow;
    while (left-- > 0 && sqlite3_step(rows.get()) == SQLITE_ROW) {
        const auto topic = topics.find(sqlite3_column_int64(rows.get(), 0));
        if (topic != topics.end()) ++topic->second.messages;
    }
    std::vector<BagTopic> found;
    for (const auto& [id, topic] : topics) add_topic(topic, found);
    return found;
}

#else

std::unique_ptr<BagReader> open_sqlite_bag(const fs::path& path) { fail_without(path); }
std::vector<BagTopic> topics_of_sqlite_bag(const fs::path& path) { fail_without(path); }

#endif

}  // namespace defrec::cli
