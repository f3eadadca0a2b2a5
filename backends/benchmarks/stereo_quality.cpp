// Prints how the disparity of the CPU backend compares with OpenCV's StereoSGBM: the table of
// docs/experiments/2026-11-25-stereo-quality.md.
// Usage: defrec_stereo_quality SHARED_DATA [SCENES [MAPS]] - folders of real data and of rendered
// scenes with disparity/*.png (256 x px); with MAPS, colour-mapped disparities are written there.
// SCENES may be "-".
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "backends/cpu/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/contract/stage_params.hpp"

namespace {

namespace fs = std::filesystem;
using namespace defrec;

struct Case {
    std::string name;
    cv::Mat left, right;  // BGR
    cv::Mat truth;        // CV_32F, px; 0: unknown
    int disparities;
};

struct Prepared {
    cv::Mat gray, mask;
};

Prepared rectify(const test::TestHost& host, const cv::Mat& image) {
    defrec_rectify_params params{};
    params.format = DEFREC_FORMAT_BGR8;
    params.source_width = uint32_t(image.cols);
    params.source_height = uint32_t(image.rows);
    fill_defaults(params);
    Prepared result{cv::Mat(image.size(), CV_8U), cv::Mat(image.size(), CV_8U)};
    const InBuffer in[] = {{image.data, image.total() * 3}};
    const OutBuffer out[] = {{result.gray.data, result.gray.total()},
                             {result.mask.data, result.mask.total()}};
    cpu::make_rectify(params, host.host())->run(in, out);
    return result;
}

// Median CPU time of a few runs, all threads together: comparable on a machine that others use too.
double median_ms(int runs, const std::function<void()>& work) {
    std::vector<double> times;
    for (int i = 0; i < runs; ++i) {
        const std::clock_t start = std::clock();
        work();
        times.push_back(1000.0 * double(std::clock() - start) / CLOCKS_PER_SEC);
    }
    return median(std::move(times));
}

// Disparities in 1/16 px as px, NaN where there is none.
cv::Mat to_pixels(const cv::Mat& disparity, int minimum) {
    cv::Mat result;
    disparity.convertTo(result, CV_32F, 1.0 / 16);
    result.setTo(std::nanf(""), disparity < minimum);
    return result;
}

void report(const Case& scene, const char* method, const cv::Mat& disparity, double ms) {
    std::vector<float> errors;
    size_t bad = 0, known = 0;
    for (int y = 0; y < scene.truth.rows; ++y)
        for (int x = 0; x < scene.truth.cols; ++x) {
            const float truth = scene.truth.at<float>(y, x), found = disparity.at<float>(y, x);
            if (!(truth > 0)) continue;
            ++known;
            if (std::isnan(found)) continue;
            errors.push_back(std::abs(found - truth));
            bad += errors.back() > 1;
        }
    if (errors.empty()) return;
    const size_t middle = errors.size() / 2;
    std::nth_element(errors.begin(), errors.begin() + long(middle), errors.end());
    std::printf("| %s | %s | %.2f | %.3f | %.1f | %.1f |\n", scene.name.c_str(), method,
                100.0 * double(bad) / double(errors.size()), double(errors[middle]),
                100.0 * double(errors.size()) / double(known), ms);
    std::fflush(stdout);
}

void write_map(const std::string& folder, const Case& scene, const char* method,
               const cv::Mat& disparity) {
    if (folder.empty()) return;
    // NOLINTNEXTLINE(misc-redundant-expression): NaN is unknown
    const cv::Mat known = disparity == disparity;
    double minimum = 0, maximum = 1;
    cv::minMaxLoc(disparity, &minimum, &maximum, nullptr, nullptr, known);
    cv::Mat scaled, map;
    disparity.convertTo(scaled, CV_8U, 255 / (maximum - minimum),
                        -minimum * 255 / (maximum - minimum));
    cv::applyColorMap(scaled, map, cv::COLORMAP_TURBO);
    map.setTo(cv::Scalar::all(0), ~known);
    cv::imwrite(folder + "/" + scene.name + "-" + method + ".png", map);
}

void compare(const Case& scene, const std::string& maps) {
    const test::TestHost host(2);
    const Prepared left = rectify(host, scene.left), right = rectify(host, scene.right);
    for (const bool three_way : {false, true}) {
        const auto matcher = cv::StereoSGBM::create(
            0, scene.disparities, 5, 8 * 25, 32 * 25, 1, 63, 10, 100, 2,
            three_way ? cv::StereoSGBM::MODE_SGBM_3WAY : cv::StereoSGBM::MODE_SGBM);
        cv::Mat disparity;
        const double ms = median_ms(3, [&] { matcher->compute(left.gray, right.gray, disparity); });
        const cv::Mat pixels = to_pixels(disparity, 0);
        report(scene, three_way ? "SGBM 3WAY" : "SGBM", pixels, ms);
        write_map(maps, scene, three_way ? "sgbm3" : "sgbm", pixels);
    }
    defrec_stereo_params params{};
    params.width = uint32_t(scene.left.cols);
    params.height = uint32_t(scene.left.rows);
    params.disparities = uint32_t(scene.disparities);
    fill_defaults(params);
    cv::Mat disparity(scene.left.size(), CV_16S);
    const InBuffer in[] = {{left.gray.data, left.gray.total()},
                           {right.gray.data, right.gray.total()},
                           {left.mask.data, left.mask.total()},
                           {right.mask.data, right.mask.total()}};
    const OutBuffer out[] = {{disparity.data, disparity.total() * 2}};
    const auto stage = cpu::make_stereo(params, host.host());
    const double ms = median_ms(15, [&] { stage->run(in, out); });
    const cv::Mat pixels = to_pixels(disparity, DEFREC_DISPARITY_NONE + 1);
    report(scene, "defrec", pixels, ms);
    write_map(maps, scene, "defrec", pixels);
}

Case middlebury(const std::string& name, const fs::path& left, const fs::path& right,
                const fs::path& truth, double scale, int disparities) {
    Case result{name, cv::imread(left), cv::imread(right), {}, disparities};
    cv::imread(truth, cv::IMREAD_GRAYSCALE).convertTo(result.truth, CV_32F, scale);
    return result;
}

// Frame of rendered_a or rendered_b: the truth is points, disparity = f * baseline / z.
Case points_case(const fs::path& folder, int frame) {
    constexpr double kFocal = 680, kBaseline = 4.6, kCentreX = 319.5, kCentreY = 179.5;
    char file[16];
    std::snprintf(file, sizeof file, "%06d.png", frame);
    Case result{folder.filename().string() + " #" + std::to_string(frame),
                cv::imread(folder / "left" / file),
                cv::imread(folder / "right" / file),
                {},
                64};
    result.truth = cv::Mat::zeros(result.left.size(), CV_32F);
    std::ifstream truth(folder / "truth.csv");
    std::string line;
    std::getline(truth, line);
    while (std::getline(truth, line)) {
        int of = 0, id = 0, visible = 0;
        double x = 0, y = 0, z = 0;
        if (std::sscanf(line.c_str(), "%d,%d,%lf,%lf,%lf,%d", &of, &id, &x, &y, &z, &visible) != 6)
            continue;
        const long u = std::lround(kFocal * x / z + kCentreX),
                   v = std::lround(kFocal * y / z + kCentreY);
        if (of != frame || visible == 0 || u < 0 || v < 0 || u >= result.truth.cols ||
            v >= result.truth.rows)
            continue;
        result.truth.at<float>(int(v), int(u)) = float(kFocal * kBaseline / z);
    }
    return result;
}

// The middle frame of a rendered scene with dense truth.
void compare_scene(const fs::path& folder, const std::string& maps) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder / "disparity"))
        files.push_back(entry.path().filename());
    if (files.empty()) return;
    std::sort(files.begin(), files.end());
    const fs::path file = files[files.size() / 2];
    Case scene{folder.filename().string(),
               cv::imread(folder / "left" / file),
               cv::imread(folder / "right" / file),
               {},
               0};
    scene.disparities = scene.left.cols > 640 ? 128 : 64;
    cv::imread(folder / "disparity" / file, cv::IMREAD_UNCHANGED)
        .convertTo(scene.truth, CV_32F, 1.0 / 256);
    compare(scene, maps);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: defrec_stereo_quality SHARED_DATA [SCENES [MAPS]]\n");
        return 2;
    }
    cv::setNumThreads(2);
    const fs::path data = argv[1];
    const std::string maps = argc > 3 ? argv[3] : "";
    std::printf(
        "| data | method | off by more than 1 px, %% | median error, px | coverage, %% | ms "
        "|\n|---|---|---|---|---|---|\n");
    const fs::path cones = data / "middlebury_cones", tsukuba = data / "middlebury_tsukuba",
                   opencv = data / "opencv";
    compare(
        middlebury("cones", cones / "im2.png", cones / "im6.png", cones / "disp2.png", 0.25, 64),
        maps);
    compare(middlebury("tsukuba", tsukuba / "imL.png", tsukuba / "imR.png",
                       tsukuba / "truedisp.pgm", 1.0 / 16, 32),
            maps);
    compare(middlebury("aloe", opencv / "aloeL.jpg", opencv / "aloeR.jpg", opencv / "aloeGT.png", 1,
                       256),
            maps);
    for (const char* name : {"rendered_a", "rendered_b"})
        for (const int frame : {0, 9}) compare(points_case(data / name, frame), maps);
    if (argc > 2 && std::string(argv[2]) != "-") {
        std::vector<fs::path> scenes;
        for (const auto& entry : fs::directory_iterator(argv[2]))
            if (entry.path().filename().string().front() != '.' &&
                fs::exists(entry.path() / "disparity"))
                scenes.push_back(entry.path());
        std::sort(scenes.begin(), scenes.end());
        for (const fs::path& scene : scenes) compare_scene(scene, maps);
    }
    return 0;
}
