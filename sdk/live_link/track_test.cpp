// `defrec track` with a live link, as a whole: what a receiver gets is what the output folder
// holds.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <igtlClientSocket.h>
#include <igtlServerSocket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "sdk/io/text.hpp"
#include "sdk/live_link/test_port.hpp"
#include "sdk/live_link/test_receiver.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 6;

const TestFolder& sequence() { return rendered_sequence<kFrames>(); }

// The program, running.
class Program {
  public:
    Program(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), DEFREC_BUILD_DIR "/bin/defrec");
        std::vector<char*> argv;
        for (std::string& argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        defrec::Pipe pipe;
        REQUIRE(pipe.open());
        child_ = ::fork();
        REQUIRE(child_ >= 0);
        if (child_ == 0) {
            ::dup2(pipe.write_end.get(), STDERR_FILENO);
            ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
            ::execv(argv[0], argv.data());
            ::_exit(99);
        }
        errors_ = std::move(pipe.read_end);
    }
    ~Program() {
        if (child_ > 0) {
            ::kill(child_, SIGKILL);
            ::waitpid(child_, nullptr, 0);
        }
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    // A line of the standard error output; empty at its end.
    std::string line() const {
        std::string text;
        for (char c = 0; ::read(errors_.get(), &c, 1) == 1 && c != '\n';) text += c;
        return text;
    }
    void interrupt() const { REQUIRE(::kill(child_, SIGINT) == 0); }
    int exit_code() {
        while (!line().empty()) {
        }
        int status = 0;
        REQUIRE(::waitpid(std::exchange(child_, -1), &status, 0) > 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }

  private:
    pid_t child_ = -1;
    defrec::Descriptor errors_;
};

std::vector<std::string> track(const fs::path& images, const std::string& out,
                               const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"track",
                                       "--left",
                                       images / "left",
                                       "--right",
                                       images / "right",
                                       "--calibration",
                                       sequence() / "calibration.yaml",
                                       "--points",
                                       sequence() / "points.csv",
                                       "--backend",
                                       "cpu",
                                       "--meshes",
                                       "--no-overlay",
                                       "--out",
                                       out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

std::vector<std::vector<std::string>> read_csv(const std::string& path) {
    std::vector<std::vector<std::string>> rows;
    const std::string text = TestFolder::read(path);
    for (const std::string_view line : split(text, '\n')) {
        if (line.empty()) continue;
        rows.emplace_back();
        for (const std::string_view field : split(line, ',')) rows.back().emplace_back(field);
    }
    return rows;
}

template <typename T>
T take(std::string_view& bytes) {
    T value;
    REQUIRE(bytes.size() >= sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
}

// Compares with deformed/*.ply, bit by bit.
void check_surface(const ReceivedFrame& frame, const std::string& out) {
    std::string name = std::to_string(frame.index);
    name.insert(0, 6 - name.size(), '0');
    const std::string file = TestFolder::read(out + "/deformed/" + name + ".ply");
    const std::string end = "end_header\n";
    REQUIRE(file.find(end) != std::string::npos);
    std::string_view body = std::string_view(file).substr(file.find(end) + end.size());
    const std::size_t count = frame.status.size();
    REQUIRE(file.find("element vertex " + std::to_string(count) + "\n") != std::string::npos);
    REQUIRE(file.find("element face " + std::to_string(frame.triangles.size() / 3) + "\n") !=
            std::string::npos);
    REQUIRE(frame.vertices.size() == 3 * count);
    REQUIRE(frame.expected_error_mm.size() == count);
    REQUIRE(frame.evidence.size() == count);
    REQUIRE(frame.covariance.size() == 9 * count);
    std::size_t differing = 0;
    const auto compare = [&](float received, float written) {
        differing +=
            std::bit_cast<std::uint32_t>(received) != std::bit_cast<std::uint32_t>(written) ? 1 : 0;
    };
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) compare(frame.vertices[3 * i + k], take<float>(body));
        for (std::size_t k = 0; k < 3; ++k) take<float>(body);  // the normal
        compare(frame.status[i], static_cast<float>(take<std::uint8_t>(body)));
        compare(frame.expected_error_mm[i], take<float>(body));
        const float* covariance = &frame.covariance[9 * i];
        CHECK(std::sqrt(covariance[0] + covariance[4] + covariance[8]) ==
              doctest::Approx(frame.expected_error_mm[i]));
    }
    for (std::size_t i = 0; i < frame.triangles.size(); i += 3) {
        differing += take<char>(body) != 3 ? 1 : 0;
        for (std::size_t k = 0; k < 3; ++k)
            differing += frame.triangles[i + k] != take<std::uint32_t>(body) ? 1 : 0;
    }
    CHECK(differing == 0);
    CHECK(body.empty());
}

// Sent is a float, which has 24 bits.
void check_number(float received, const std::string& written, double tolerance) {
    const double expected = parse_double(written).value();
    CHECK(std::abs(static_cast<double>(received) - expected) <
          tolerance + std::ldexp(std::abs(expected), -24));
}

// Rows of points.csv; those of targets.csv have their depth after the id.
void check_image(const ReceivedFrame& frame, const fs::path& images) {
    const auto index = static_cast<std::size_t>(frame.index);
    const cv::Mat left = cv::imread(images_of(images / "left").at(index).string());
    REQUIRE(frame.components == 3);
    REQUIRE(frame.image_size[0] == left.cols);
    REQUIRE(frame.image_size[1] == left.rows);
    REQUIRE(frame.pixels.size() == left.total() * 3);
    std::size_t differing = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
        differing += frame.pixels[i] != left.data[i + 2 - 2 * (i % 3)];
    CHECK(differing == 0);
}

using Rows = std::vector<std::vector<std::string>>;

// The rows of a frame, without what is lost.
Rows rows_of(const ReceivedFrame& frame, const Rows& rows) {
    Rows chosen;
    for (const auto& row : rows)
        if (row[0] == std::to_string(frame.index) && row[8] != "lost") chosen.push_back(row);
    return chosen;
}

// Compares with the rows, which have four decimals.
void check_points(const std::vector<ReceivedPoint>& points, const Rows& rows) {
    REQUIRE(points.size() == rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        CHECK(points[i].name == rows[i][2]);
        CHECK(points[i].group == rows[i][8]);
        for (std::size_t k = 0; k < 3; ++k) check_number(points[i].xyz[k], rows[i][3 + k], 0.6e-4);
        check_number(points[i].radius, rows[i][9], 0.6e-4);
    }
}

// As those of points.csv; none where no targets were given.
Rows target_rows(const std::string& path) {
    if (!fs::exists(path)) return {};
    Rows rows = read_csv(path);
    for (auto& row : rows) row.erase(row.begin() + 3);
    return rows;
}

void check_targets(const ReceivedFrame& frame, const Rows& rows) {
    check_points(frame.targets, rows);
    REQUIRE(frame.target_positions.size() == 3 * rows.size());
    REQUIRE(frame.target_error_mm.size() == rows.size());
    REQUIRE(frame.target_covariance.size() == 9 * rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const float* covariance = &frame.target_covariance[9 * i];
        CHECK(frame.target_error_mm[i] == frame.targets[i].radius);
        for (std::size_t k = 0; k < 3; ++k)
            CHECK(frame.target_positions[3 * i + k] == frame.targets[i].xyz[k]);
        std::size_t column = 10;
        for (const std::size_t place : {0, 1, 2, 4, 5, 8})
            check_number(covariance[place], rows[i][column++], 0.6e-6);
    }
}

// Each frame against the rows and the mesh that the program wrote for it; the last must be the
// program's last.
void check_frames(const std::vector<ReceivedFrame>& frames, const std::string& out) {
    const auto rows = read_csv(out + "/frames.csv");
    const auto points = read_csv(out + "/points.csv");
    const Rows targets = target_rows(out + "/targets.csv");
    REQUIRE(rows.size() > 1);
    REQUIRE_FALSE(frames.empty());
    for (const ReceivedFrame& frame : frames) {
        CAPTURE(frame.index);
        const auto& row = rows.at(static_cast<std::size_t>(frame.index) + 1);
        CHECK(frame.state == row[2]);
        CHECK(frame.text.starts_with("reasons=" + row[3] + " "));
        CHECK(std::abs(frame.seconds * 1e3 + frame.fraction / 4294967.296 -
                       parse_double(row[1]).value()) < 1e-3);
        CHECK(frame.versions == std::vector<unsigned>(frame.messages.size(), 1));
        check_points(frame.points, rows_of(frame, points));
        check_targets(frame, rows_of(frame, targets));
        const bool has_geometry = frame.state != "lost" && frame.state != "initialising";
        CHECK(frame.messages.size() - (frame.components > 0) == (!has_geometry     ? 1
                                                                 : targets.empty() ? 4
                                                                                   : 6));
        if (has_geometry) check_surface(frame, out);
    }
    CHECK(std::to_string(frames.back().index) == rows.back()[0]);
}

std::vector<ReceivedFrame> receive_all(igtl::Socket& socket) {
    std::vector<ReceivedFrame> frames;
    FrameReader reader(from_socket(socket));
    while (auto frame = reader.next()) frames.push_back(std::move(*frame));
    socket.CloseSocket();
    return frames;
}

}  // namespace

TEST_CASE(
    "--igtl: the receiver gets what the folder holds, to the last frame, and nothing of a lost "
    "frame but its "
    "state") {
    const TestFolder folder;
    fs::copy(sequence().path(), folder.path(), fs::copy_options::recursive);
    const fs::path black = images_of(folder / "left").back();
    cv::imwrite(black.string(), cv::Mat::zeros(240, 320, CV_8UC3));
    auto server = igtl::ServerSocket::New();
    REQUIRE(server->CreateServer(0) == 0);
    const std::string port = std::to_string(server->GetServerPort());
    const std::string targets =
        folder.write("targets.csv", "id,x,y,z,depth\n7,0,0,90,\n-3,5,-4,95,20\n8,900,900,80,\n");
    Program program(track(folder.path(), folder / "out",
                          {"--quiet", "--realtime", "--targets", targets, "--igtl",
                           "127.0.0.1:" + port, "--igtl-image"}));
    const auto socket = server->WaitForConnection();
    REQUIRE(socket.IsNotNull());
    const std::vector<ReceivedFrame> frames = receive_all(*socket);
    CHECK(program.exit_code() == 0);
    check_frames(frames, folder / "out");
    for (const ReceivedFrame& frame : frames) check_image(frame, folder.path());
    CHECK(frames.front().targets.size() == 2);  // the third is far from the body
    CHECK(frames.back().targets.empty());
    CHECK(frames.back().state == "lost");
    CHECK(frames.back().code == igtl::StatusMessage::STATUS_NOT_FOUND);
    CHECK(frames.back().text.find("dark") != std::string::npos);

    const auto summary = nlohmann::json::parse(TestFolder::read(folder / "out/summary.json"));
    const auto& link = summary["live_link"];
    CHECK(link["endpoint"] == "127.0.0.1:" + port);
    CHECK(link["receivers"] == 1);
    CHECK(link["frames_sent"] == frames.size());
    CHECK(link["frames_dropped"] ==
          kFrames - static_cast<int>(frames.size()) - frames.front().index);
    constexpr double kFramesPerSecond = 30;
    CHECK(summary["seconds"].get<double>() >= (kFrames - 1) / kFramesPerSecond);  // --realtime
}

TEST_CASE(
    "--igtl-listen: a receiver may come late, and Ctrl-C sends the last frame before the program "
    "ends") {
    const TestFolder folder;
    repeat_sequence(sequence(), folder);
    Program program(track(folder.path(), folder / "out", {"--igtl-listen", "0"}));
    const std::string line = program.line(), start = "defrec: live link: listening at 127.0.0.1:";
    REQUIRE(line.starts_with(start));
    const auto port =
        parse_integer(std::string_view(line).substr(start.size(), line.size() - start.size() - 1));
    REQUIRE(port);
    auto socket = igtl::ClientSocket::New();
    REQUIRE(socket->ConnectToServer("127.0.0.1", static_cast<int>(*port)) == 0);
    std::vector<ReceivedFrame> frames;
    FrameReader reader(from_socket(*socket));
    while (auto frame = reader.next()) {
        frames.push_back(std::move(*frame));
        if (frames.size() == 3) program.interrupt();
    }
    socket->CloseSocket();
    CHECK(program.exit_code() == 130);
    CHECK(frames.size() > 3);
    check_frames(frames, folder / "out");
}

TEST_CASE("--display-delay: the receiver gets what is followed where it is when it is shown") {
    const TestFolder folder;
    auto server = igtl::ServerSocket::New();
    REQUIRE(server->CreateServer(0) == 0);
    const std::string out = folder / "out";
    Program program(track(sequence().path(), out,
                          {"--quiet", "--realtime", "--display-delay", "50", "--igtl",
                           "127.0.0.1:" + std::to_string(server->GetServerPort())}));
    const auto socket = server->WaitForConnection();
    REQUIRE(socket.IsNotNull());
    const std::vector<ReceivedFrame> frames = receive_all(*socket);
    CHECK(program.exit_code() == 0);
    Rows shown, tracked = read_csv(out + "/points.csv");
    for (std::vector<std::string>& row : read_csv(out + "/display.csv")) {
        if (row[3] != "point") continue;
        CHECK(parse_double(row[2]).value() - parse_double(row[1]).value() ==
              doctest::Approx(50).epsilon(1e-4));
        row.erase(row.begin() + 2, row.begin() + 4);  // display_ms, kind
        row.erase(row.begin() + 3, row.begin() + 5);  // part, target
        shown.push_back(std::move(row));
    }
    CHECK(shown.size() + 1 == tracked.size());
    REQUIRE_FALSE(frames.empty());
    std::size_t moved = 0;
    for (const ReceivedFrame& frame : frames) {
        CAPTURE(frame.index);
        const Rows expected = rows_of(frame, shown), before = rows_of(frame, tracked);
        check_points(frame.points, expected);
        REQUIRE(expected.size() == before.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            moved += expected[i][4] != before[i][4] ? 1 : 0;
            CHECK(parse_double(expected[i][9]).value() >= parse_double(before[i][9]).value());
        }
        if (frame.state != "lost") check_surface(frame, out);  // as in the frame
    }
    CHECK(moved > 0);
}

TEST_CASE("--igtl-clock system: stamps are the time of day, and as far apart as the frames") {
    const TestFolder folder;
    auto server = igtl::ServerSocket::New();
    REQUIRE(server->CreateServer(0) == 0);
    const std::string target = "127.0.0.1:" + std::to_string(server->GetServerPort());
    const auto now = [] {
        return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    };
    const double before = now();
    Program program(track(sequence().path(), folder / "out",
                          {"--realtime", "--igtl", target, "--igtl-clock", "system"}));
    const auto socket = server->WaitForConnection();
    REQUIRE(socket.IsNotNull());
    const std::vector<ReceivedFrame> frames = receive_all(*socket);
    CHECK(program.exit_code() == 0);
    const double after = now();
    const auto rows = read_csv(folder / "out/frames.csv");
    REQUIRE_FALSE(frames.empty());
    std::optional<double> first;
    for (const ReceivedFrame& frame : frames) {
        const double stamp = frame.seconds + std::ldexp(frame.fraction, -32);
        CHECK(stamp > before);
        CHECK(stamp < after);
        const auto& row = rows.at(static_cast<std::size_t>(frame.index) + 1);
        const double start = stamp - parse_double(row[1]).value() / 1e3;
        if (!first) first = start;
        CHECK(start == doctest::Approx(*first).epsilon(1e-14));
    }
}

TEST_CASE("nobody to receive is no failure; what cannot be opened or understood is") {
    const TestFolder folder;
    const TestPort port;
    const Socket busy = listen_at({"127.0.0.1", 0});
    const auto exit_code = [&](const std::vector<std::string>& more) {
        return Program(track(sequence().path(), folder / "out", more)).exit_code();
    };
    CHECK(exit_code({"--igtl-listen", to_string(local_endpoint(busy))}) == 7);
    CHECK_FALSE(fs::exists(folder / "out"));
    CHECK(exit_code({"--view", std::to_string(local_endpoint(busy).port)}) == 7);
    CHECK(exit_code({"--igtl", to_string(port.endpoint())}) == 0);
    const auto summary = nlohmann::json::parse(TestFolder::read(folder / "out/summary.json"));
    CHECK(summary["live_link"]["receivers"] == 0);
    CHECK(summary["notes"].dump().find("reached nobody") != std::string::npos);
    for (const auto& wrong :
         std::vector<std::vector<std::string>>{{"--igtl", "127.0.0.1"},
                                               {"--igtl", "127.0.0.1:0"},
                                               {"--igtl", "127.0.0.1:70000"},
                                               {"--igtl", "not a host:1"},
                                               {"--igtl-listen", "70000"},
                                               {"--igtl-listen", "-1"},
                                               {"--igtl-clock", "system"},
                                               {"--igtl-clock", "sundial", "--igtl-listen", "0"},
                                               {"--view", "70000"},
                                               {"--igtl-listen", "0", "--igtl", "127.0.0.1:1"}}) {
        CAPTURE(wrong.back());
        CHECK(exit_code(wrong) == 2);
    }
}
