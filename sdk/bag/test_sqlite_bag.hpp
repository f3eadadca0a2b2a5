// For tests: writes bags of rosbag2 in SQLite files.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace defrec::cli {

class SqliteBag {
  public:
    explicit SqliteBag(const std::filesystem::path& path, const char* tables = kTables) {
        expect(sqlite3_open(path.c_str(), &handle_), SQLITE_OK);
        run("PRAGMA journal_mode = WAL");
        run(tables);
    }
    ~SqliteBag() { sqlite3_close(handle_); }
    SqliteBag(const SqliteBag&) = delete;
    SqliteBag& operator=(const SqliteBag&) = delete;

    void run(const std::string& statement) {
        expect(sqlite3_exec(handle_, statement.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    }

    // Its number.
    int add_topic(std::string_view name, std::string_view type) {
        sqlite3_stmt* statement = prepared(
            "INSERT INTO topics(name, type, serialization_format, offered_qos_profiles,"
            " type_description_hash) VALUES(?, ?, 'cdr', '', '')");
        bind_text(statement, 1, name);
        bind_text(statement, 2, type);
        finish(statement);
        return static_cast<int>(sqlite3_last_insert_rowid(handle_));
    }

    // timestamp: of its arrival, which readers do not look at.
    void add(int topic, int timestamp, std::string_view data) {
        sqlite3_stmt* statement =
            prepared("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)");
        sqlite3_bind_int(statement, 1, topic);
        sqlite3_bind_int(statement, 2, timestamp);
        sqlite3_bind_blob64(statement, 3, data.data(), data.size(), nullptr);
        finish(statement);
    }

  private:
    // The tables of rosbag2's storage plugin.
    static constexpr char kTables[] =
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,"
        " metadata TEXT NOT NULL);"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,"
        " type_description_hash TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

    static void expect(int result, int expected) {
        if (result != expected) throw std::runtime_error(sqlite3_errstr(result));
    }
    sqlite3_stmt* prepared(const char* text) {
        sqlite3_stmt* statement = nullptr;
        expect(sqlite3_prepare_v2(handle_, text, -1, &statement, nullptr), SQLITE_OK);
        return statement;
    }
    static void bind_text(sqlite3_stmt* statement, int place, std::string_view text) {
        sqlite3_bind_text(statement, place, text.data(), static_cast<int>(text.size()), nullptr);
    }
    static void finish(sqlite3_stmt* statement) {
        const int result = sqlite3_step(statement);
        sqlite3_finalize(statement);
        expect(result, SQLITE_DONE);
    }

    sqlite3* handle_ = nullptr;
};

}  // namespace defrec::cli
