// Bags as files and as folders.
#include "sdk/bag/bag.hpp"

#include <doctest/doctest.h>

#include "sdk/bag/test_bag.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

std::string file_with(std::string_view data) {
    McapWriter writer;
    writer.add(writer.add_channel("/a", "type"), data);
    return writer.finish();
}

// As rosbag2 of ROS 2 Jazzy writes it.
constexpr char kMetadata[] = R"(rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration:
    nanoseconds: 2000000000
  starting_time:
    nanoseconds_since_epoch: 1700000000000000000
  message_count: 20
  topics_with_message_count:
    - topic_metadata:
        name: /a
        type: type
        serialization_format: cdr
        offered_qos_profiles:
          - history: keep_last
            depth: 10
            deadline:
              sec: 9223372036
              nsec: 854775807
        type_description_hash: RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f752
      message_count: 20
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - rec_1.mcap
    - rec_0.mcap
  files:
    - path: rec_1.mcap
      starting_time:
        nanoseconds_since_epoch: 1700000000000000000
  custom_data: ~
  ros_distro: jazzy
)";

std::string all_of(const std::string& source) {
    BagMessages messages(files_of_bag(source));
    BagMessage message;
    std::string all;
    while (messages.next(message)) all.append(message.data.begin(), message.data.end()).append(" ");
    return all + messages.fault();
}

std::string refusal(const std::string& source) {
    return refusal_of([&] { files_of_bag(source); });
}

}  // namespace

TEST_CASE("a folder's files follow its metadata, or their names without it") {
    const TestFolder folder;
    const std::string file = folder.write("rec_0.mcap", file_with("a"));
    folder.write("rec_1.mcap", file_with("b"));
    folder.write("rec_10.mcap", file_with("c"));
    folder.write("notes.txt", "x");
    CHECK(all_of(file) == "a ");
    CHECK(all_of(folder.path().string()) == "a b c ");
    CHECK(topics_of_bag(files_of_bag(folder.path())).front().messages == 3);
    folder.write("metadata.yaml", kMetadata);
    CHECK(all_of(folder.path().string()) == "b a ");
    // Files are looked for in the folder alone.
    folder.write("metadata.yaml", with(with(kMetadata, "- rec_0.mcap", "- ../other/rec_0.mcap"),
                                       "- rec_1.mcap", "- /etc/rec_1.mcap"));
    CHECK(all_of(folder.path().string()) == "b a ");
}

TEST_CASE("what is no such bag is refused with what to do") {
    const TestFolder folder;
    CHECK_SAYS(refusal(folder / "none"), "no such file or folder");
    CHECK_SAYS(refusal(folder.path().string()), "holds no MCAP or SQLite file");
    CHECK_SAYS(refusal(folder.write("a.bag", "#ROSBAG V2.0")), "bags of ROS 1 are not read");
    folder.write("metadata.yaml", with(kMetadata, "identifier: mcap", "identifier: rosbag_v2"));
    CHECK_SAYS(refusal(folder.path().string()), "storage_identifier: 'rosbag_v2' is not read");
    folder.write("metadata.yaml", with(kMetadata, "mode: \"\"", "mode: FILE"));
    CHECK_SAYS(refusal(folder.path().string()), "compression_mode: files or messages");
    folder.write("metadata.yaml", "a: b\n");
    CHECK_SAYS(refusal(folder.path().string()), "rosbag2_bagfile_information");
    folder.write("metadata.yaml", kMetadata);
    CHECK_SAYS(refusal_of([&] { all_of(folder.path().string()); }), "rec_1.mcap");
}

TEST_CASE("row 198: after a file that is cut off none is read") {
    const TestFolder folder;
    folder.write("rec_0.mcap", file_with("a"));
    folder.write("rec_1.mcap", file_with("b").substr(0, 100));
    folder.write("rec_2.mcap", file_with("c"));
    const std::string all = all_of(folder.path().string());
    CHECK(all.starts_with("a "));
    CHECK_SAYS(all, "rec_1.mcap: the file is cut off");
    CHECK(all.find("c ") == std::string::npos);
}

TEST_CASE("a further file that is gone, or is none, is a fault and no exception") {
    const TestFolder folder;
    folder.write("metadata.yaml", kMetadata);
    folder.write("rec_1.mcap", file_with("b"));
    CHECK_SAYS(all_of(folder.path().string()), "b " + (folder / "rec_0.mcap") + ": ");
    folder.write("rec_0.mcap", "something else");
    CHECK_SAYS(all_of(folder.path().string()), "b " + (folder / "rec_0.mcap") + ": ");
}
