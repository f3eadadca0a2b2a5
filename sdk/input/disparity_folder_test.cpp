// Files with disparity: what is read of them, to which frame they belong, and what is refused.
#include "sdk/input/disparity_folder.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "sdk/input/frame_source.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 96, kHeight = 64;

// Rows from the last one up.
std::string pfm(const std::vector<float>& values, bool is_little_endian = true) {
    std::string text = std::string("Pf\n96 64\n") + (is_little_endian ? "-1.0\n" : "1.0\n");
    for (int y = kHeight - 1; y >= 0; --y)
        for (int x = 0; x < kWidth; ++x) {
            char bytes[4];
            std::memcpy(bytes, &values[static_cast<std::size_t>(y * kWidth + x)], sizeof bytes);
            if (!is_little_endian) std::swap(bytes[0], bytes[3]), std::swap(bytes[1], bytes[2]);
            text.append(bytes, sizeof bytes);
        }
    return text;
}

std::vector<float> ramp() {
    std::vector<float> values(std::size_t{kWidth} * kHeight);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) / 16;
    return values;
}

void write_png(const std::string& path, int type = CV_16UC1, int width = kWidth) {
    cv::Mat image(kHeight, width, type, cv::Scalar::all(0));
    if (type == CV_16UC1) image.at<std::uint16_t>(3, 5) = 10 * 256 + 64;
    cv::imwrite(path, image);
}

}  // namespace

TEST_CASE("PFM and PNG of 16 bits are read, by the numbers in their names") {
    const TestFolder folder;
    std::vector<float> values = ramp();
    values[7] = std::numeric_limits<float>::infinity();
    values[8] = std::numeric_limits<float>::quiet_NaN();
    folder.write("frame_012.pfm", pfm(values));
    folder.write("13.PFM", pfm(ramp(), false));
    write_png(folder / "disp0014.png");
    folder.write("notes.txt", "of the network");
    const DisparityFolder read(folder.path());
    std::vector<float> expected = ramp();
    CHECK(*read.read(13, kWidth, kHeight) == expected);
    expected[7] = expected[8] = 0;
    CHECK(*read.read(12, kWidth, kHeight) == expected);
    const auto png = read.read(14, kWidth, kHeight);
    CHECK((*png)[3 * kWidth + 5] == 10.25f);
    CHECK((*png)[0] == 0);
    CHECK(read.read(15, kWidth, kHeight) == nullptr);
}

TEST_CASE("of several numbers in the names the last one counts that differs") {
    using Names = std::vector<std::filesystem::path>;
    using Numbers = std::vector<std::optional<std::int64_t>>;
    CHECK(numbers_of(Names{"001_disp16.png", "002_disp16.png"}) == Numbers{1, 2});
    CHECK(numbers_of(Names{"cam0_007.png", "cam0_008.png"}) == Numbers{7, 8});
    CHECK(numbers_of(Names{"2026_7_1.png", "2027_8_1.png"}) == Numbers{7, 8});
    CHECK(numbers_of(Names{"cam0_007.png"}) == Numbers{7});
    CHECK(numbers_of(Names{"a12", "no", "b3_4", "99999999999999999999"}) ==
          Numbers{12, std::nullopt, 4, std::nullopt});
    CHECK(numbers_of({}).empty());
    const TestFolder folder;
    folder.write("001_disp16.pfm", pfm(ramp()));
    folder.write("002_disp16.pfm", pfm(ramp()));
    const DisparityFolder read(folder.path());
    CHECK(read.first() == 1);
    CHECK(read.last() == 2);
}

TEST_CASE("row 202: files of disparity that are of no use, each with its path") {
    const TestFolder folder;
    const auto refused = [&](const std::string& name, const std::string& text) {
        folder.write(name, text);
        const std::string said =
            refusal_of([&] { DisparityFolder(folder.path()).read(1, kWidth, kHeight); });
        CHECK_SAYS(said, name);
        std::filesystem::remove(folder / name);
        return said;
    };
    const std::string good = pfm(ramp());
    CHECK_SAYS(refused("1.pfm", ""), "one channel");
    CHECK_SAYS(refused("1.pfm", with(good, "Pf\n", "PF\n")), "one channel");
    CHECK_SAYS(refused("1.pfm", "Pf\n96 64\n"), "header");
    CHECK_SAYS(refused("1.pfm", "Pf\n96 64\n0\n"), "header");
    CHECK_SAYS(refused("1.pfm", "Pf\n-96 64\n-1\n"), "header");
    for (const char* scale : {"nan", "-nan", "inf", "-inf"})
        CHECK_SAYS(refused("1.pfm", with(good, "\n-1.0\n", std::string("\n") + scale + "\n")),
                   "header");
    CHECK_SAYS(refused("1.pfm", with(good, "96 64", "64 96")), "64x96");
    CHECK_SAYS(refused("1.pfm", with(good, "96 64", "99999999 99999999")), "rectified left image");
    CHECK_SAYS(refused("1.pfm", good.substr(0, good.size() - 1)), "bytes of disparity");
    CHECK_SAYS(refused("1.pfm", good + "x"), "bytes of disparity");
    std::vector<float> values = ramp();
    values[2 * kWidth + 9] = -3;
    CHECK_SAYS(refused("1.pfm", pfm(values)), "pixel (9, 2) is -3.000");
    values[2 * kWidth + 9] = 2000.5f;
    CHECK_SAYS(refused("1.pfm", pfm(values)), "pixel (9, 2) is 2000.500 px; up to 2000 px");
    CHECK_SAYS(refused("1.png", "no image"), "no PNG");
    write_png(folder / "made.png");
    const std::string png = TestFolder::read(folder / "made.png");
    std::filesystem::remove(folder / "made.png");
    CHECK_SAYS(refused("1.png", png.substr(0, png.size() / 2)), "cut short");
    write_png(folder / "made.png", CV_8UC1);
    const std::string gray = TestFolder::read(folder / "made.png");
    write_png(folder / "made.png", CV_16UC1, kWidth / 2);
    const std::string narrow = TestFolder::read(folder / "made.png");
    std::filesystem::remove(folder / "made.png");
    CHECK_SAYS(refused("1.png", gray), "16 bits");
    CHECK_SAYS(refused("1.png", narrow), "48x64");

    CHECK_SAYS(refusal_of([&] { DisparityFolder(folder / "absent"); }), "cannot be read");
    CHECK_SAYS(refusal_of([&] { DisparityFolder(folder.path()); }), "no .pfm and no .png");
    folder.write("left.pfm", good);
    CHECK_SAYS(refusal_of([&] { DisparityFolder(folder.path()); }), "no number");
    std::filesystem::remove(folder / "left.pfm");
    folder.write("a1.pfm", good);
    folder.write("b01.pfm", good);
    CHECK_SAYS(refusal_of([&] { DisparityFolder(folder.path()); }), "it has the number of");
}

TEST_CASE("a frame has the disparity of its left image's number, or none") {
    const TestFolder folder;
    for (const char* view : {"left", "right"}) {
        std::filesystem::create_directory(folder / view);
        for (int i = 0; i < 4; ++i)
            cv::imwrite(folder / view + "/img" + std::to_string(20 + i) + ".png",
                        cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(10 + i)));
    }
    std::filesystem::create_directory(folder / "network");
    folder.write("network/0021.pfm", pfm(ramp()));
    folder.write("network/0023.pfm", pfm(ramp()));
    SourceOptions options;
    options.left = folder / "left";
    options.right = folder / "right";
    options.disparity = folder / "network";
    options.disparity_sigma_px = 0.25f;
    for (const std::int64_t first : {0, 1}) {
        options.range = {first, {}};
        FrameSource source(options);
        StereoFrame frame;
        for (std::int64_t i = first; i < 4; ++i) {
            REQUIRE(source.next(frame));
            CHECK(frame.index == i);
            CHECK((frame.disparity != nullptr) == (i % 2 == 1));
            if (frame.disparity) CHECK(*frame.disparity == ramp());
            if (frame.disparity) CHECK(frame.disparity_sigma_px == 0.25f);
        }
        CHECK_FALSE(source.next(frame));
        CHECK(source.fault().empty());
    }
    options.fields = FieldOrder::kTopFirst;
    CHECK_THROWS_AS(FrameSource{options}, CliError);
}

TEST_CASE("row 202: files of other frames, and frames without a file, are told") {
    const TestFolder folder;
    for (const char* view : {"left", "right", "network", "counted"})
        std::filesystem::create_directory(folder / view);
    for (const char* view : {"left", "right"})
        for (int i = 0; i < 3; ++i)
            cv::imwrite(folder / view + "/img" + std::to_string(20 + i) + ".png",
                        cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(10 + i)));
    for (const char* name : {"network/21.pfm", "network/22.pfm", "network/23.pfm", "network/24.pfm",
                             "counted/0.pfm", "counted/2.pfm"})
        folder.write(name, pfm(ramp()));
    SourceOptions options;
    options.left = folder / "left";
    options.right = folder / "right";
    options.disparity = folder / "network";
    options.disparity_sigma_px = 0.25f;
    const auto remark = [&] {
        FrameSource source(options);
        StereoFrame frame;
        while (source.next(frame)) continue;
        return source.disparity_remark();
    };
    CHECK(remark() == "1 of 3 frames has no file in " + options.disparity +
                          "; stage stereo measured the disparity. 2 files of " + options.disparity +
                          " are of no frame that was read.");
    // Others are not expected of a part.
    options.range = {1, 2};
    CHECK(remark() == "");
    // A run of which no frame has a file is refused.
    options.range = {0, 1};
    CHECK_SAYS(refusal_of([&] { FrameSource(SourceOptions(options)); }), "no file is of a frame");
    options.range = {};
    options.disparity = folder / "counted";
    CHECK_SAYS(refusal_of([&] { FrameSource(SourceOptions(options)); }),
               "counted: no file is of a frame: the files have the numbers 0 to 2, the frames 20 "
               "to 22. Name each file by the number of its left image");
}

TEST_CASE("row 202: a file that is of no use ends the frames behind the ones before it") {
    const TestFolder folder;
    for (const char* view : {"left", "right", "network"})
        std::filesystem::create_directory(folder / view);
    for (const char* view : {"left", "right"})
        for (int i = 0; i < 3; ++i)
            cv::imwrite(folder / view + "/img" + std::to_string(i) + ".png",
                        cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(10 + i)));
    folder.write("network/0.pfm", pfm(ramp()));
    folder.write("network/1.pfm", "Pf\n");
    SourceOptions options;
    options.left = folder / "left";
    options.right = folder / "right";
    options.disparity = folder / "network";
    options.disparity_sigma_px = 0.25f;
    FrameSource source(options);
    StereoFrame frame;
    CHECK(source.next(frame));
    CHECK_FALSE(source.next(frame));
    CHECK_SAYS(source.fault(), "1.pfm: its header");
    CHECK_FALSE(source.next(frame));
}
