// See view_recordings.hpp.
#include "sdk/session/view_recordings.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "sdk/io/counted.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

// Whatever its extension: that depends on what this OpenCV can encode.
bool has_file(const fs::path& folder, const std::string& stem) {
    std::error_code error;
    const fs::directory_iterator entries(folder, error);
    return std::any_of(begin(entries), end(entries), [&](const fs::directory_entry& entry) {
        return entry.path().stem() == stem;
    });
}

}  // namespace

ViewRecordings::ViewRecordings(fs::path folder, Open open, bool leaves_out)
    : folder_(std::move(folder)), open_(std::move(open)), leaves_out_(leaves_out) {}

void ViewRecordings::start(const std::optional<TemplateRecord>& reference) {
    guard([&] {
        made_.emplace(Recording{open_(folder_ / next_name())});
        if (reference) made_->video->set_template(*reference);
    });
}

void ViewRecordings::stop() {
    if (!made_) return;
    made_->end = std::async([&video = *made_->video] { video.finish(); });
    ending_.push_back(std::move(*made_));
    made_.reset();
}

void ViewRecordings::set_template(const TemplateRecord& reference) {
    if (made_) guard([&] { made_->video->set_template(reference); });
}

void ViewRecordings::add(const cv::Mat& left, const FrameRecord& record, std::string_view told) {
    if (!made_) return;
    if (leaves_out_ && made_->video->is_behind()) {
        ++made_->left_out;
        return;
    }
    guard([&] {
        made_->video->add(left, record, told);
        ++made_->pictures;
    });
}

std::string ViewRecordings::name() const { return made_ ? made_->name() : std::string(); }

void ViewRecordings::finish() {
    stop();
    for (Recording& recording : ending_) conclude(recording);
    ending_.clear();
}

std::vector<std::string> ViewRecordings::take_notes() {
    std::erase_if(ending_, [this](Recording& recording) {
        if (recording.end.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
            return false;
        conclude(recording);
        return true;
    });
    return std::exchange(notes_, {});
}

// A recording that fails ends.
void ViewRecordings::guard(const std::function<void()>& function) {
    try {
        function();
    } catch (const std::exception& error) {
        add_failure(error);
        made_.reset();
    }
}

void ViewRecordings::add_failure(const std::exception& error) {
    notes_.push_back(std::string("A recording of the live view failed: ") + error.what());
}

void ViewRecordings::conclude(Recording& recording) {
    try {
        recording.end.get();
        if (recording.pictures > 0) written_.push_back(recording.name());
    } catch (const std::exception& error) {
        add_failure(error);
        return;
    }
    if (recording.left_out > 0)
        notes_.push_back(recording.name() + " lacks " +
                         counted(static_cast<std::size_t>(recording.left_out), "picture") +
                         ", for which the encoder was too slow.");
}

std::string ViewRecordings::next_name() {
    std::array<char, 32> stem{};
    do {
        std::snprintf(stem.data(), stem.size(), "recording_%03d", ++number_);
    } while (has_file(folder_, stem.data()));
    return std::string(stem.data()) + ".mp4";
}

}  // namespace defrec::cli
