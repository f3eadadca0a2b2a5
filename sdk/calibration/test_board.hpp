// For tests: a stereo camera with distorting lenses that films a board.
#pragma once

#include <cmath>
#include <filesystem>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <random>
#include <string>
#include <vector>

namespace defrec::cli {

struct TestLens {
    cv::Matx33d matrix;
    cv::Vec<double, 5> distortion;
};

struct TestRig {
    cv::Size size{640, 480};
    TestLens left{{560, 0, 312, 0, 563, 245, 0, 0, 1}, {-0.28, 0.11, 0.0008, -0.0006, -0.02}};
    TestLens right{{566, 0, 327, 0, 568, 236, 0, 0, 1}, {-0.26, 0.09, -0.0005, 0.0007, -0.01}};
    cv::Matx33d rotation = rotation_of({0.004, -0.012, 0.006});
    cv::Vec3d translation{-4.6, 0.05, -0.08};

    static cv::Matx33d rotation_of(const cv::Vec3d& turn) {
        cv::Matx33d made;
        cv::Rodrigues(turn, made);
        return made;
    }
};

// A board's gray values, 0 .. 255, at (x, y) mm from its corner.
struct TestBoard {
    int across = 10, down = 7;
    double square_mm = 4;
    cv::Mat markers;  // of a ChArUco board, kScale pixels a square

    static constexpr int kScale = 60;
    static TestBoard charuco(double marker_mm) {
        TestBoard board;
        cv::aruco::CharucoBoard::create(board.across, board.down,
                                        static_cast<float>(board.square_mm),
                                        static_cast<float>(marker_mm),
                                        cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50))
            ->draw(cv::Size(kScale * board.across, kScale * board.down), board.markers);
        return board;
    }
    double gray(double x, double y) const {
        constexpr double kDark = 30, kBright = 220, kBehind = 110, kRange = 255;
        const double u = x / square_mm, v = y / square_mm;
        const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
        if (column < 0 || row < 0 || column >= across || row >= down) {
            const bool is_rim = u > -1 && v > -1 && u < across + 1 && v < down + 1;
            return is_rim ? kBright : kBehind;
        }
        if (markers.empty()) return (column + row) % 2 == 0 ? kDark : kBright;
        return kDark + (kBright - kDark) / kRange *
                           markers.at<unsigned char>(static_cast<int>(v * kScale),
                                                     static_cast<int>(u * kScale));
    }
};

struct TestPose {
    cv::Matx33d rotation;
    cv::Vec3d place;  // of the board's middle
};

// Images of one lens: rays of kSamples x kSamples in a pixel, computed once.
class TestCamera {
  public:
    TestCamera(const cv::Size& size, const TestLens& lens) : size_(size) {
        std::vector<cv::Point2d> pixels;
        for (int y = 0; y < size.height; ++y)
            for (int x = 0; x < size.width; ++x)
                for (int s = 0; s < kSamples * kSamples; ++s)
                    pixels.emplace_back(x + (s % kSamples + 0.5) / kSamples - 0.5,
                                        y + (s / kSamples + 0.5) / kSamples - 0.5);
        const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-12);
        cv::undistortPoints(pixels, rays_, lens.matrix, lens.distortion, cv::noArray(),
                            cv::noArray(), until);
    }
    // noise: standard deviation, gray values
    cv::Mat film(const TestBoard& board, const TestPose& pose, double noise,
                 std::mt19937& random) const {
        const cv::Vec3d normal(pose.rotation(0, 2), pose.rotation(1, 2), pose.rotation(2, 2));
        const double away = normal.dot(pose.place);
        cv::Mat image(size_, CV_8U);
        std::normal_distribution<double> of_sensor(0, noise);
        const auto samples = static_cast<std::size_t>(kSamples * kSamples);
        for (std::size_t pixel = 0; pixel < rays_.size() / samples; ++pixel) {
            double sum = 0;
            for (std::size_t s = 0; s < samples; ++s) {
                const cv::Point2d& at = rays_[pixel * samples + s];
                const cv::Vec3d ray(at.x, at.y, 1);
                const cv::Vec3d hit =
                    pose.rotation.t() * (ray * (away / normal.dot(ray)) - pose.place);
                sum += board.gray(hit[0] + 0.5 * board.across * board.square_mm,
                                  hit[1] + 0.5 * board.down * board.square_mm);
            }
            image.data[pixel] = cv::saturate_cast<unsigned char>(
                sum / static_cast<double>(samples) + of_sensor(random));
        }
        return image;
    }

  private:
    static constexpr int kSamples = 3;
    cv::Size size_;
    std::vector<cv::Point2d> rays_;
};

struct TestFilm {
    std::vector<cv::Mat> left, right;
};

// Whether the whole board, with a rim, is in the image.
inline bool is_seen(const TestRig& rig, const TestLens& lens, const TestBoard& board,
                    const TestPose& pose) {
    std::vector<cv::Point3d> outline;
    for (int i = 0; i <= 4 * board.across; ++i) {
        const double x = (i % (2 * board.across + 1) - board.across) * 0.5 * board.square_mm,
                     y = (i <= 2 * board.across ? -0.5 : 0.5) * board.down * board.square_mm;
        outline.emplace_back(x, y, 0);
    }
    cv::Vec3d turn;
    cv::Rodrigues(pose.rotation, turn);
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(outline, turn, pose.place, lens.matrix, lens.distortion, pixels);
    const cv::Rect2d image(4, 4, rig.size.width - 8, rig.size.height - 8);
    for (const cv::Point2d& pixel : pixels)
        if (!image.contains(pixel)) return false;
    return true;
}

inline TestPose seen_by_right(const TestRig& rig, const TestPose& pose) {
    return {rig.rotation * pose.rotation, rig.rotation * pose.place + rig.translation};
}

// `count` poses that both views see, near and far, tilted to each side, up to the corners.
inline std::vector<TestPose> test_poses(const TestRig& rig, const TestBoard& board, int count,
                                        double tilt, std::mt19937& random) {
    std::uniform_real_distribution<double> any(-1, 1);
    std::vector<TestPose> poses;
    while (static_cast<int>(poses.size()) < count) {
        const double away = 72 + 22 * any(random);
        const TestPose pose{
            TestRig::rotation_of({tilt * any(random), tilt * any(random), 0.3 * any(random)}),
            {0.55 * away * any(random), 0.42 * away * any(random), away}};
        if (is_seen(rig, rig.left, board, pose) &&
            is_seen(rig, rig.right, board, seen_by_right(rig, pose)))
            poses.push_back(pose);
    }
    return poses;
}

inline TestFilm film_of(const TestRig& rig, const TestBoard& board, int count, double tilt) {
    constexpr double kNoise = 2;
    std::mt19937 random(7);
    const TestCamera left(rig.size, rig.left), right(rig.size, rig.right);
    TestFilm film;
    for (const TestPose& pose : test_poses(rig, board, count, tilt, random)) {
        film.left.push_back(left.film(board, pose, kNoise, random));
        film.right.push_back(right.film(board, seen_by_right(rig, pose), kNoise, random));
    }
    return film;
}

inline void write_images(const std::string& folder, const std::vector<cv::Mat>& images) {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    for (std::size_t i = 0; i < images.size(); ++i)
        cv::imwrite(folder + "/" + std::to_string(1000 + i) + ".png", images[i]);
}

// Lossless.
inline bool write_video(const std::string& path, const std::vector<cv::Mat>& images) {
    cv::VideoWriter writer(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('F', 'F', 'V', '1'), 10,
                           images.front().size(), false);
    if (!writer.isOpened()) return false;
    for (const cv::Mat& image : images) writer.write(image);
    return true;
}

}  // namespace defrec::cli
