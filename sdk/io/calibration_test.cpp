// Rows 1-15 of the faults that the program answers: what is wrong with a calibration file, and what
// is said about it.
#include "sdk/io/calibration.hpp"

#include <doctest/doctest.h>

#include <array>
#include <clocale>
#include <cmath>
#include <cstdio>
#include <locale>
#include <numbers>
#include <random>
#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

const std::string kGood = R"(%YAML:1.0
---
image_width: 640
image_height: 480
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 701.5, 0., 320.25, 0., 702.5, 240.75, 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0.02, 1e-3, -5e-4, 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 703.5, 0., 321.25, 0., 704.5, 241.75, 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.11, 0.021, 1e-3, -4e-4, 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -4.6, 0.01, -0.02 ]
)";
const std::string kM1 = "701.5, 0., 320.25, 0., 702.5, 240.75, 0., 0., 1.";
const std::string kD1 = "-0.1, 0.02, 1e-3, -5e-4, 0.";
const std::string kR = "1., 0., 0., 0., 1., 0., 0., 0., 1. ]\nT";
const std::string kT = "-4.6, 0.01, -0.02";

std::string refusal(const std::string& source, LengthUnit unit = LengthUnit::kGuarded) {
    return refusal_of([&] { load_calibration(source, unit); }, ExitCode::kCalibration);
}

std::string refusal_of_text(const std::string& text, LengthUnit unit = LengthUnit::kGuarded) {
    const TestFolder folder;
    const std::string path = folder.write("calibration.yaml", text);
    const std::string message = refusal(path, unit);
    if (message != "accepted") CHECK(message.find("calibration.yaml") != std::string::npos);
    return message;
}

StereoCalibration load_text(const std::string& text, LengthUnit unit = LengthUnit::kGuarded) {
    const TestFolder folder;
    return load_calibration(folder.write("calibration.yaml", text), unit);
}

void check_good(const StereoCalibration& calibration) {
    CHECK(calibration.width == 640);
    CHECK(calibration.height == 480);
    CHECK(calibration.left.fx == 701.5);
    CHECK(calibration.left.cy == 240.75);
    CHECK(calibration.right.cx == 321.25);
    REQUIRE(calibration.left.distortion.size() == 5);
    CHECK(calibration.left.distortion[3] == -5e-4);
    CHECK(calibration.translation[0] == -4.6);
    CHECK(calibration.rotation[8] == 1.0);
}

}  // namespace

TEST_CASE("a good file gives its numbers, also with other names and without a size") {
    check_good(load_text(kGood));
    std::string text = with(with(kGood, "M1:", "K1:"), "M2:", "K2:");
    check_good(load_text(text));
    text = with(with(kGood, "M1:", "cameraMatrix1:"), "M2:", "cameraMatrix2:");
    check_good(load_text(with(with(text, "D1:", "distCoeffs1:"), "D2:", "distCoeffs2:")));
    text = with(with(kGood, "image_width: 640\n", ""), "image_height: 480\n", "");
    CHECK(load_text(text).width == 0);
    CHECK_SAYS(refusal_of_text(with(kGood, "image_width: 640\n", "")), "belong together");
    CHECK_SAYS(refusal_of_text(with(kGood, "T:", "Q:")), "T: this key is missing");
}

TEST_CASE("a file of another kind is told as such, with what was expected") {
    const std::string expected = "OpenCV's stereo YAML with M1 D1 M2 D2 R T was expected";
    const std::string summary = refusal_of_text(
        "{\"defrec\": \"0.1\", \"options\": {}, \"rectified_camera\": {\"fx\": 1}}");
    CHECK_SAYS(summary, "calibration.yaml:1: this is the summary of a run of defrec track");
    CHECK_SAYS(summary, expected);
    CHECK_SAYS(refusal_of_text("disparities: 64\n"), "this is no calibration, none of its keys");
    const std::string ros = refusal_of_text("image_width: 640\ncamera_matrix: [1]\n");
    CHECK_SAYS(ros, "this is the camera_info of one camera");
    CHECK_SAYS(ros, "left.yaml,right.yaml");
    CHECK_SAYS(refusal_of_text("id,u,v\n0,1,2\n"), expected);
    CHECK_SAYS(refusal_of_text(std::string("\x89PNG\r\n\x1a\n\0\0", 10)), expected);
    CHECK(refusal("absent.yaml").find(expected) == std::string::npos);
    // A misspelt key is told by itself.
    CHECK(refusal_of_text(with(kGood, "D1:", "Dl:")).find(expected) == std::string::npos);
}

TEST_CASE("row 1: NaN and Inf are refused with file, key and line") {
    for (const char* value : {".nan", ".NaN", ".Inf", "-.inf", "nan", "inf", "1e999"}) {
        const std::string message = refusal_of_text(with(kGood, "701.5", value));
        CHECK_SAYS(message, "calibration.yaml:9: M1");
    }
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "-4.6, .Nan, 0")), "calibration.yaml:34: T");
}

TEST_CASE("row 2: focal lengths that are not positive and a centre far outside are refused") {
    CHECK_SAYS(refusal_of_text(with(kGood, "701.5", "0")), "M1: fx = 0.000");
    CHECK_SAYS(refusal_of_text(with(kGood, "704.5", "-704.5")),
               "M2: fx = 703.500 and fy = -704.500");
    CHECK_SAYS(refusal_of_text(with(kGood, "320.25", "5000")),
               "calibration.yaml:5: M1: the centre 5000.0,240.8");
    CHECK_SAYS(refusal_of_text(with(kGood, "0., 702.5", "0.5, 702.5")), "skew");
}

TEST_CASE("row 3: a zero or tiny baseline is refused") {
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "0, 0, 0")),
               "calibration.yaml:30: T: the baseline is zero");
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "-0.02, 0, 0"), LengthUnit::kMillimetre),
               "outside 0.1..1000 mm");
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "-2000, 0, 0")), "outside 0.1..1000 mm");
}

TEST_CASE("row 4: metres given for millimetres are guessed, and the override is named and works") {
    const std::string metres = with(kGood, kT, "-0.0046, 0.00001, -0.00002");
    const std::string message = refusal_of_text(metres);
    CHECK_SAYS(message, "metres");
    CHECK_SAYS(message, "--units m");
    CHECK(load_text(metres, LengthUnit::kMetre).translation[0] == doctest::Approx(-4.6));
}

TEST_CASE("row 4: the unit that is guessed is one in which the baseline can be") {
    for (const char* baseline : {"-0.46, 0, 0", "-0.18, 0, 0", "-0.8, 0, 0"}) {
        const std::string text = with(kGood, kT, baseline);
        const std::string message = refusal_of_text(text);
        CHECK_SAYS(message, "looks like centimetres or inches");
        CHECK_SAYS(message, "--units mm");
        CHECK(load_text(text, LengthUnit::kMillimetre).translation[0] < 0);
    }
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "-0.05, 0, 0")), "looks like metres");
    // 0.00046 mm in metres.
    const std::string message = refusal_of_text(with(kGood, kT, "-0.00000046, 0, 0"));
    CHECK_SAYS(message, "outside 0.1..1000 mm");
    CHECK(message.find("looks like") == std::string::npos);
}

TEST_CASE("row 5: views swapped in the calibration are refused with the hint") {
    const std::string message = refusal_of_text(with(kGood, kT, "4.6, 0.01, -0.02"));
    CHECK_SAYS(message, "calibration.yaml:30: T");
    CHECK_SAYS(message, "swapped");
}

TEST_CASE("what is refused can be read as it stands, with T in mm") {
    const TestFolder folder;
    const std::string path =
        folder.write("calibration.yaml", with(with(kGood, kT, "4.6, 0, 0"), "701.5", "-1"));
    const StereoCalibration calibration = read_calibration(written_calibration(path));
    CHECK(calibration.translation[0] == 4.6);
    CHECK(calibration.left.fx == -1);
    CHECK(calibration.width == 640);
    CHECK(read_calibration(written_calibration(path), LengthUnit::kMetre).translation[0] ==
          doctest::Approx(4600));
}

TEST_CASE("row 7: an R that is no rotation is refused with the residual") {
    CHECK_SAYS(refusal_of_text(with(kGood, kR, "1.1, 0., 0., 0., 1., 0., 0., 0., 1. ]\nT")),
               "0.210000");
    CHECK_SAYS(refusal_of_text(with(kGood, kR, "-1., 0., 0., 0., 1., 0., 0., 0., 1. ]\nT")),
               "not a rotation");
    CHECK_SAYS(refusal_of_text(with(kGood, kR, "0., 0., 0., 0., 0., 0., 0., 0., 0. ]\nT")),
               "calibration.yaml:25: R");
    // Six digits are enough to be taken for a rotation, and are made one.
    const StereoCalibration rounded = load_text(
        with(kGood, kR, "0.999950, -0.010000, 0., 0.010000, 0.999950, 0., 0., 0., 1. ]\nT"));
    const auto& r = rounded.rotation;
    CHECK(std::abs(r[0] * r[0] + r[3] * r[3] + r[6] * r[6] - 1) < 1e-14);
}

TEST_CASE("row 8: vertical and forward baselines are unsupported") {
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "0.1, -4.6, 0")), "above each other");
    CHECK_SAYS(refusal_of_text(with(kGood, kT, "-0.1, 0, -4.6")), "in front of the other");
}

TEST_CASE("row 9: distortion of a wrong length is refused") {
    const std::string three = with(kGood, "cols: 5\n   dt: d\n   data: [ " + kD1,
                                   "cols: 3\n   dt: d\n   data: [ 1, 2, 3");
    CHECK_SAYS(refusal_of_text(three), "calibration.yaml:10: D1");
    CHECK_SAYS(refusal_of_text(three), "0, 4, 5, 8, 12 or 14");
    for (const int length : {4, 8, 12, 14}) {
        std::string zeros = "-0.1";
        for (int i = 1; i < length; ++i) zeros += ", 0";
        const StereoCalibration calibration =
            load_text(with(kGood, "cols: 5\n   dt: d\n   data: [ " + kD1,
                           "cols: " + std::to_string(length) + "\n   dt: d\n   data: [ " + zeros));
        CHECK(calibration.left.distortion.size() == static_cast<std::size_t>(length));
    }
}

TEST_CASE("row 10: a size that differs from the frames' is an error and nothing is scaled") {
    StereoCalibration calibration = load_text(kGood);
    CHECK_NOTHROW(fit_to_frames(calibration, 640, 480));
    const std::string message =
        refusal_of([&] { fit_to_frames(calibration, 1280, 960); }, ExitCode::kCalibration);
    CHECK_SAYS(message, ":3: image_width");
    CHECK_SAYS(message, "1280x960");
    CHECK(calibration.width == 640);
}

TEST_CASE("frames of twice the calibration's size are answered with the option of both views") {
    const auto refusal_of_size = [](int width, int height) -> std::string {
        StereoCalibration calibration = load_text(kGood);
        return refusal_of([&] { fit_to_frames(calibration, width, height); },
                          ExitCode::kCalibration);
    };
    CHECK_SAYS(refusal_of_size(1280, 480), "--layout side-by-side");
    CHECK_SAYS(refusal_of_size(640, 960), "--layout top-bottom");
}

TEST_CASE("row 11: a locale with a decimal comma changes nothing") {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
        char do_thousands_sep() const override { return '.'; }
        std::string do_grouping() const override { return "\3"; }
    };
    const std::string c_before = std::setlocale(LC_ALL, nullptr);
    const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
    bool has_c_locale = false;
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"}) {
        has_c_locale = has_c_locale || std::setlocale(LC_ALL, name) != nullptr;
    }
    if (!has_c_locale) MESSAGE("no C locale with a comma is installed; only the C++ one was tried");
    check_good(load_text(kGood));
    const std::string message = refusal_of_text(with(kGood, kT, "4.6, 0.01, -0.02"));
    std::locale::global(before);
    std::setlocale(LC_ALL, c_before.c_str());
    CHECK_SAYS(message, "T = (4.6000, 0.0100, -0.0200)");
    CHECK_SAYS(refusal_of_text(with(kGood, "701.5", "'701,5'")), "not a number");
}

TEST_CASE("row 12: deep, aliased and huge files are refused before they cost anything") {
    CHECK_SAYS(refusal_of_text("M1: " + std::string(50000, '[') + std::string(50000, ']')),
               "16 levels");
    std::string map = "a: 1\n";
    for (int i = 0; i < 40; ++i) {
        map.pop_back();
        map = std::string("k").append(std::to_string(i)).append(": {").append(map).append("}\n");
    }
    CHECK_SAYS(refusal_of_text(map), "16 levels");
    CHECK_SAYS(refusal_of_text("M1: &a [1]\nM2: *a\n"), "anchors");
    CHECK_SAYS(refusal_of_text("M1: &a [*a]\n"), "anchors");
    CHECK_SAYS(refusal_of_text("M1: *nowhere\n"), "anchor");
    CHECK_SAYS(refusal_of_text("&a M1: 1\n"), "anchors");
    CHECK_SAYS(refusal_of_text(kGood + std::string(1'100'000, '#')), "larger than 1000 kB");
    std::string keys;
    for (int i = 0; i < 100'000; ++i) keys.append("k").append(std::to_string(i)).append(": 1\n");
    CHECK_SAYS(refusal_of_text(keys), "500 keys");
}

TEST_CASE("row 13: a duplicate key is refused, and an unknown one names the nearest") {
    CHECK_SAYS(refusal_of_text(kGood + "image_width: 640\n"), "calibration.yaml:35: image_width");
    CHECK_SAYS(refusal_of_text(kGood + "image_width: 640\n"), "line 3");
    CHECK_SAYS(refusal_of_text(with(kGood, "image_width", "image_widht")),
               "the nearest that is: image_width");
    CHECK_SAYS(refusal_of_text(with(kGood, "M1:", "m1:")), "calibration.yaml:5: m1");
    CHECK_SAYS(
        refusal_of_text(with(kGood, "M1: !!opencv-matrix\n   rows", "M1: !!opencv-matrix\n   row")),
        "M1.row: this key is not known; the nearest that is: rows");
    CHECK_SAYS(refusal_of_text(with(kGood, "M1:", "K1: 1\nM1:")), "keep one of the two");
}

TEST_CASE(
    "row 14: empty and binary files are refused; a byte order mark and CR LF change nothing") {
    CHECK_SAYS(refusal_of_text(""), "empty");
    CHECK_SAYS(refusal_of_text("# nothing\n"), "empty");
    CHECK_SAYS(refusal_of_text(std::string("M1: \0\1\2", 7)), "binary");
    CHECK_SAYS(refusal_of_text(std::string("\xFF\xFEM\0", 4)), "UTF-16");
    CHECK_SAYS(refusal_of_text("just an error message\n"), "key: value");
    CHECK_SAYS(refusal_of_text("M1: [1, 2\n"), "not valid YAML");
    check_good(load_text("\xEF\xBB\xBF" + kGood));
    std::string crlf;
    for (const char c : kGood) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    check_good(load_text(crlf));
    const TestFolder folder;
    CHECK_SAYS(refusal(folder / "absent.yaml"), "no such file");
    CHECK_SAYS(refusal("/dev/null"), "not a regular file");
}

TEST_CASE("row 15: a wrong matrix size is refused, whatever it claims") {
    const std::string huge = with(kGood, "M1: !!opencv-matrix\n   rows: 3\n   cols: 3",
                                  "M1: !!opencv-matrix\n   rows: 30000\n   cols: 30000");
    CHECK_SAYS(refusal_of_text(huge),
               "calibration.yaml:5: M1: the matrix is 30000x30000; expected: 3x3");
    const std::string beyond =
        with(kGood, "M1: !!opencv-matrix\n   rows: 3", "M1: !!opencv-matrix\n   rows: 3000000000");
    CHECK_SAYS(refusal_of_text(beyond), "M1.rows");
    CHECK_SAYS(refusal_of_text(with(kGood, kM1, "1, 2, 3")), "data holds 3 numbers");
    CHECK_SAYS(refusal_of_text(with(
                   kGood, "M1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d",
                   "M1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: " + std::string(300, 'd'))),
               "M1.dt");
    CHECK_SAYS(refusal_of_text(with(
                   kGood,
                   "R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., "
                   "0., 1., 0., 0., 0., 1. ]",
                   "R: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0, 0, 0 ]")),
               "R: the matrix is 3x1; expected: 3x3");
}

TEST_CASE(
    "a pair of ROS camera_info files gives the same rig; P of the right camera is in metres") {
    const auto camera = [](const char* name, double p3) {
        return "image_width: 640\nimage_height: 480\ncamera_name: " + std::string(name) +
               "\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [700, 0, 320, 0, 700, 240, 0, 0, "
               "1]\n"
               "distortion_model: plumb_bob\n"
               "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.1, 0, 0, 0, 0]\n"
               "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
               "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [680, 0, 320, " +
               std::to_string(p3) + ", 0, 680, 240, 0, 0, 0, 1, 0]\n";
    };
    const TestFolder folder;
    const std::string left = folder.write("left.yaml", camera("left", 0));
    const std::string right = folder.write("right.yaml", camera("right", -680 * 0.0046));
    for (const std::string& source : {left + "," + right, folder.path().string()}) {
        const StereoCalibration calibration = load_calibration(source);
        CHECK(calibration.translation[0] == doctest::Approx(-4.6));
        CHECK(calibration.left.fx == 700);
        CHECK(calibration.width == 640);
    }
    CHECK_SAYS(refusal(right + "," + left), "left,right");
    CHECK_SAYS(refusal(left + "," + left), "baseline is zero");
    folder.write("right.yaml", camera("right", -680 * 4.6));
    CHECK_SAYS(refusal(folder.path().string()), "--units mm");
    CHECK(load_calibration(folder.path().string(), LengthUnit::kMillimetre).translation[0] ==
          doctest::Approx(-4.6));
    folder.write("right.yaml", with(camera("right", -3.128), "plumb_bob", "equidistant"));
    CHECK_SAYS(refusal(folder.path().string()), "distortion_model: 'equidistant'");
}

TEST_CASE("views that converge are the same rig from OpenCV's file and from ROS's pair") {
    // Each view turned inwards by half of 12 degrees to a place 300 mm away, and its sensor shifted
    // outwards by 40 px.
    constexpr double kHalf = 6 * std::numbers::pi / 180, kFocal = 3700;
    const double base = 600 * std::sin(kHalf), c = std::cos(kHalf), s = std::sin(kHalf);
    const auto list = [](const std::vector<double>& values) {
        std::string text;
        for (const double value : values) {
            char number[32];
            std::snprintf(number, sizeof number, "%.17g", value);
            text.append(text.empty() ? "" : ", ").append(number);
        }
        return text;
    };
    const auto matrix = [&](double side) {
        return list({kFocal, 0, 320 + 40 * side, 0, kFocal, 240, 0, 0, 1});
    };
    const double c2 = std::cos(2 * kHalf), s2 = std::sin(2 * kHalf);
    std::string opencv = with(kGood, kM1, matrix(-1));
    opencv = with(opencv, "703.5, 0., 321.25, 0., 704.5, 241.75, 0., 0., 1.", matrix(1));
    opencv = with(opencv, kD1, "0, 0, 0, 0, 0");
    opencv = with(opencv, "-0.11, 0.021, 1e-3, -4e-4, 0.", "0, 0, 0, 0, 0");
    opencv = with(opencv, kR, list({c2, 0, s2, 0, 1, 0, -s2, 0, c2}) + " ]\nT");
    opencv = with(opencv, kT, list({-300 * s2, 0, 300 * (1 - c2)}));
    const auto ros = [&](double side, double p3) {
        return "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
               "  data: [" +
               matrix(side) + "]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [" +
               list({c, 0, -side * s, 0, 1, 0, side * s, 0, c}) +
               "]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [" +
               list({kFocal, 0, 320 + 350 * side, p3, 0, kFocal, 240, 0, 0, 0, 1, 0}) + "]\n";
    };
    const StereoCalibration given = load_text(opencv);
    const TestFolder folder;
    folder.write("left.yaml", ros(-1, 0));
    folder.write("right.yaml", ros(1, -kFocal * base / 1000));
    const StereoCalibration pair = load_calibration(folder.path().string());
    CHECK(given.left.cx == 280);
    CHECK(given.right.cx == 360);
    CHECK(pair.left.cx == given.left.cx);
    CHECK(pair.right.cx == given.right.cx);
    for (size_t i = 0; i < 9; ++i) CHECK(std::abs(pair.rotation[i] - given.rotation[i]) < 1e-12);
    for (size_t i = 0; i < 3; ++i)
        CHECK(std::abs(pair.translation[i] - given.translation[i]) < 1e-9);
}

TEST_CASE("rows 1-15: truncated and damaged files never crash, and what is accepted is sound") {
    const TestFolder folder;
    std::mt19937 random(20);
    int accepted = 0;
    const auto survives = [&](const std::string& text) {
        const std::string path = folder.write("damaged.yaml", text);
        try {
            const StereoCalibration calibration = load_calibration(path);
            ++accepted;
            CHECK(calibration.left.fx > 0);
            CHECK(calibration.translation[0] < 0);
            CHECK(std::isfinite(calibration.translation[1]));
        } catch (const CliError& error) {
            CHECK(error.code() == ExitCode::kCalibration);
        }
    };
    for (std::size_t length = 0; length < kGood.size(); length += 7)
        survives(kGood.substr(0, length));
    const std::string marks = "[]{}:,-?*&!|>'\"%@#\n\t 0.eE+";
    for (int i = 0; i < 1000; ++i) {
        std::string text = kGood;
        for (int flips = 1 + static_cast<int>(random() % 4); flips > 0; --flips) {
            char& target = text[random() % text.size()];
            target =
                random() % 2 ? static_cast<char>(random() % 256) : marks[random() % marks.size()];
        }
        survives(text);
    }
    CHECK(accepted > 0);
}

TEST_CASE("the shared calibrations load" *
          doctest::skip(!std::filesystem::exists(DEFREC_SHARED_DATA_DIR))) {
    for (const char* name : {"rendered_a", "rendered_b", "invivo1", "heart_phantom_f7"}) {
        const StereoCalibration calibration = load_calibration(std::string(DEFREC_SHARED_DATA_DIR) +
                                                               "/" + name + "/calibration.yaml");
        CHECK(calibration.translation[0] < 0);
        CHECK(is_rectified(calibration) == (std::string(name) != "heart_phantom_f7"));
    }
}
