// Compares the features of the stage orb with those of cv::ORB and prints the table of
// docs/experiments/2026-11-21-orb-quality.md.
//
// usage: defrec_orb_quality DATA SCENES [FEATURES]     DATA: the shared data; SCENES: a folder of
// rendered scenes
//
// Both kinds of features go through the stage match, with its defaults. A match is right if it is
// within 3 px of the truth; recall is right matches over features of the first image that are
// visible in the second. livers has no truth: there a match counts as right within 15 px of the
// best homography. cv::ORB gets FAST threshold 5: with its default of 20 it finds next to nothing
// on tissue.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <stdexcept>
#include <string>

#include "backends/benchmarks/image_pairs.hpp"
#include "backends/benchmarks/orb_features.hpp"
#include "sdk/base/util/median.hpp"

namespace {

using namespace defrec;
using namespace defrec::benchmarks;

constexpr double kRight = 3;         // px
constexpr double kRightLivers = 15;  // px
constexpr double kMargin = 18;       // px; nearer the border no method finds features
constexpr int kRepeat = 15;

struct Detection {
    std::vector<defrec_feature> features;
    double milliseconds;
};

Detection detect_here(const GrayImage& image, uint32_t capacity) {
    OrbResult result = orb_features(image, capacity, kRepeat);
    return {std::move(result.features), result.milliseconds};
}

Detection detect_opencv(const GrayImage& image, uint32_t capacity) {
    const cv::Mat pixels(int(image.height), int(image.width), CV_8U,
                         const_cast<uint8_t*>(image.pixels.data()));
    const auto orb =
        cv::ORB::create(int(capacity), 1.2F, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31, 5);
    std::vector<cv::KeyPoint> keys;
    cv::Mat descriptors;
    std::vector<double> times;
    for (int i = 0; i < kRepeat; ++i) {
        const std::clock_t start = std::clock();
        orb->detectAndCompute(pixels, cv::noArray(), keys, descriptors);
        times.push_back(1e3 * double(std::clock() - start) / CLOCKS_PER_SEC);
    }
    Detection detection{{}, median(std::move(times))};
    for (size_t i = 0; i < keys.size(); ++i) {
        defrec_feature feature{};
        feature.x = int32_t(std::lround(16 * keys[i].pt.x));
        feature.y = int32_t(std::lround(16 * keys[i].pt.y));
        std::memcpy(feature.descriptor, descriptors.ptr(int(i)), sizeof feature.descriptor);
        detection.features.push_back(feature);
    }
    return detection;
}

Point pixel(const defrec_feature& feature) { return {feature.x / 16.0, feature.y / 16.0}; }

// The cells of an 8 x 8 grid over the image that points lie in.
class Grid {
  public:
    explicit Grid(const GrayImage& image) : image_(image) {}
    void mark(Point p) {
        const auto cell = [](double x, uint32_t side) {
            return size_t(std::clamp(int(x * 8 / side), 0, 7));
        };
        marked_[cell(p.y, image_.height) * 8 + cell(p.x, image_.width)] = true;
    }
    double share() const {
        return double(std::count(std::begin(marked_), std::end(marked_), true)) / 64;
    }

  private:
    const GrayImage& image_;
    bool marked_[64] = {};
};

// Sums over the pairs of a data set.
struct Score {
    double pairs = 0, features = 0, matches = 0, classified = 0, right = 0, possible = 0,
           spread = 0, right_spread = 0, milliseconds = 0;
};

// livers: the homography that most matches agree with stands for the truth.
std::optional<Flow> fitted(const std::vector<defrec_feature>& first,
                           const std::vector<defrec_feature>& second,
                           const std::vector<defrec_match>& matches) {
    std::vector<cv::Point2d> from, to;
    for (size_t i = 0; i < matches.size(); ++i) {
        if (matches[i].feature < 0) continue;
        const Point a = pixel(first[i]), b = pixel(second[size_t(matches[i].feature)]);
        from.emplace_back(a.x, a.y);
        to.emplace_back(b.x, b.y);
    }
    if (from.size() < 8) return std::nullopt;
    const cv::Mat found =
        cv::findHomography(from, to, cv::RANSAC, kRightLivers, cv::noArray(), 5000);
    if (found.empty()) return std::nullopt;
    double h[9];
    std::copy_n(found.ptr<double>(), 9, h);
    return Flow::homography(h);
}

template <class Detect>
void add(const ImagePair& pair, uint32_t capacity, Detect detect, Score& score) {
    const Detection first = detect(pair.first, capacity), second = detect(pair.second, capacity);
    const std::vector<defrec_match> matches = match_features(first.features, second.features);
    const std::optional<Flow> flow =
        pair.flow ? pair.flow : fitted(first.features, second.features, matches);
    const double limit = pair.flow ? kRight : kRightLivers;
    Grid all(pair.first), right(pair.first);
    for (size_t i = 0; i < first.features.size(); ++i) {
        const Point from = pixel(first.features[i]);
        all.mark(from);
        score.matches += matches[i].feature >= 0;
        const std::optional<Point> truth = flow ? (*flow)(from) : std::nullopt;
        if (!truth) continue;
        score.possible += truth->x >= kMargin && truth->y >= kMargin &&
                          truth->x < pair.second.width - kMargin &&
                          truth->y < pair.second.height - kMargin;
        if (matches[i].feature < 0) continue;
        const Point to = pixel(second.features[size_t(matches[i].feature)]);
        ++score.classified;
        if (std::hypot(to.x - truth->x, to.y - truth->y) > limit) continue;
        ++score.right;
        right.mark(from);
    }
    ++score.pairs;
    score.features += double(first.features.size());
    score.spread += all.share();
    score.right_spread += right.share();
    score.milliseconds += first.milliseconds;
}

void print(const std::string& set, const char* method, const Score& s) {
    std::printf("| %s | %s | %.0f | %.0f | %.0f | %.2f | %.3f | %.2f | %.2f | %.1f |\n",
                set.c_str(), method, s.features / s.pairs, s.matches / s.pairs, s.right / s.pairs,
                s.right / std::max(1.0, s.classified), s.right / std::max(1.0, s.possible),
                s.spread / s.pairs, s.right_spread / s.pairs, s.milliseconds / s.pairs);
    std::fflush(stdout);
}

void compare(const std::vector<ImagePair>& pairs, uint32_t capacity) {
    if (pairs.empty()) return;
    Score here, opencv;
    for (const ImagePair& pair : pairs) {
        add(pair, capacity, detect_here, here);
        add(pair, capacity, detect_opencv, opencv);
    }
    print(pairs[0].set, "defrec", here);
    print(pairs[0].set, "cv::ORB", opencv);
}

void run(const std::string& data, const std::string& scenes, uint32_t capacity) {
    cv::setNumThreads(1);
    std::puts(
        "| data | method | features | matches | right | precision | recall | grid cells with a "
        "feature | "
        "with a right match | CPU ms |\n"
        "|---|---|---|---|---|---|---|---|---|---|");
    for (const char* name : {"heartbeat", "respiration", "indentation", "fast-cut", "out-of-body",
                             "smoke", "stretch", "heartbeat-360x288", "indentation-360x288"})
        compare(load_scene(scenes + "/" + name, name, {11, 22, 33, 44, 55}), capacity);
    for (const char* name : {"rendered_a", "rendered_b"})
        compare(load_scene(data + "/" + name, name, {4, 8, 12}), capacity);
    const std::string samples = data + "/opencv/";
    compare(
        load_pair(samples + "graf1.png", samples + "graf3.png", samples + "H1to3p.xml", "graf1-3"),
        capacity);
    compare(
        load_pair(data + "/livers/liver1.jpg", data + "/livers/liver2.jpg", "", "livers (15 px)"),
        capacity);
}

}  // namespace

int main(int count, char** arguments) {
    try {
        if (count < 3 || count > 4)
            throw std::runtime_error("usage: defrec_orb_quality DATA SCENES [FEATURES]");
        run(arguments[1], arguments[2], count == 4 ? uint32_t(std::stoul(arguments[3])) : 1000);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
