// See stereo_topics.hpp.
#include "sdk/bag/stereo_topics.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>

#include "sdk/bag/ros_messages.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::string_view kLeft = "left", kRight = "right";

bool is_image(const BagTopic& topic) {
    return topic.encoding == "cdr" &&
           (topic.type == kImageType || topic.type == kCompressedImageType);
}

// With each "left" in it replaced; empty where there is none.
std::string partner_of(std::string_view name, std::string_view from, std::string_view to) {
    std::string partner;
    std::size_t at = 0, begin = 0;
    for (; (at = name.find(from, begin)) != std::string_view::npos; begin = at + from.size())
        partner.append(name.substr(begin, at - begin)).append(to);
    return begin == 0 ? std::string() : partner.append(name.substr(begin));
}

class Choice {
  public:
    Choice(const std::string& bag, const std::vector<BagTopic>& topics)
        : bag_(bag), topics_(topics) {}

    [[noreturn]] void fail(const std::string& what) const {
        throw CliError(ExitCode::kInput, bag_ + ": " + what + " " + images_text());
    }

    // The topic of images that was asked for.
    BagTopic named(const std::string& name) const {
        const auto topic = std::find_if(topics_.begin(), topics_.end(),
                                        [&](const BagTopic& each) { return each.name == name; });
        const std::string shown = in_quotes(name);
        if (topic == topics_.end()) fail("there is no topic " + shown + ".");
        if (!is_image(*topic))
            fail("topic " + shown + " has the type " + in_quotes(topic->type) + " in " +
                 in_quotes(topic->encoding) +
                 "; sensor_msgs/msg/Image or CompressedImage in 'cdr' was expected.");
        if (topic->messages == 0) fail("topic " + shown + " has no message.");
        return *topic;
    }

    std::optional<BagTopic> find(const std::string& name) const {
        for (const BagTopic& topic : topics_)
            if (topic.name == name && is_image(topic) && topic.messages > 0) return topic;
        return std::nullopt;
    }

    // The only pair whose names differ by left and right alone.
    StereoTopics only_pair() const {
        std::vector<StereoTopics> pairs;
        for (const BagTopic& topic : topics_) {
            const auto left = find(topic.name);
            const std::string partner = partner_of(topic.name, kLeft, kRight);
            const auto right = partner.empty() ? std::nullopt : find(partner);
            if (left && right && left->is_same(topic) && left->type == right->type)
                pairs.push_back({*left, *right});
        }
        if (pairs.empty())
            fail(
                "no two topics of images are told to be the left and the right view by their "
                "names; name them with --left-topic and --right-topic, or say with --layout how "
                "the images of one topic hold both views.");
        if (pairs.size() > 1)
            fail(
                "several pairs of topics could be the two views; choose one with --left-topic and "
                "--right-topic.");
        return pairs.front();
    }

    // The only topic of images.
    BagTopic only_one() const {
        std::vector<BagTopic> found;
        std::copy_if(topics_.begin(), topics_.end(), std::back_inserter(found),
                     [](const BagTopic& topic) { return is_image(topic) && topic.messages > 0; });
        if (found.empty()) fail("no topic has images that could hold both views.");
        if (found.size() > 1)
            fail(
                "several topics have images; name that whose images hold both views with "
                "--stereo-topic, or leave out --layout where each view has its own topic.");
        return found.front();
    }

    // The partner of a topic, where only that one was named.
    BagTopic partner(const std::string& name, std::string_view from, std::string_view to,
                     const char* option) const {
        const std::string other = partner_of(name, from, to);
        const auto topic = other.empty() ? std::nullopt : find(other);
        if (!topic)
            fail("no topic of images is told to be the other view of " + in_quotes(name) +
                 " by its name; give " + option + " as well.");
        return *topic;
    }

  private:
    std::string images_text() const {
        std::string text;
        for (const BagTopic& topic : topics_) {
            if (topic.type.find("Image") == std::string::npos) continue;
            text.append(text.empty() ? "Its topics of images: " : ", ")
                .append(printable(topic.name))
                .append(" (")
                .append(printable(topic.type));
            if (topic.encoding != "cdr") text.append(" in ").append(printable(topic.encoding));
            text.append(", ").append(std::to_string(topic.messages)).append(")");
        }
        return text.empty() ? "It has no topic of images." : text + ".";
    }

    const std::string& bag_;
    const std::vector<BagTopic>& topics_;
};

// Without what image_transport appends.
std::string_view without_transport(std::string_view topic) {
    constexpr std::string_view kCompressed = "/compressed";
    if (topic.ends_with(kCompressed)) topic.remove_suffix(kCompressed.size());
    return topic;
}

}  // namespace

StereoTopics choose_topics(const std::string& bag, const std::vector<BagTopic>& topics,
                           const std::string& left, const std::string& right) {
    const Choice choice(bag, topics);
    if (left.empty() && right.empty()) return choice.only_pair();
    const BagTopic named = choice.named(left.empty() ? right : left);
    if (right.empty()) return {named, choice.partner(left, kLeft, kRight, "--right-topic")};
    if (left.empty()) return {choice.partner(right, kRight, kLeft, "--left-topic"), named};
    if (left == right) choice.fail(in_quotes(left) + " cannot be both views.");
    return {named, choice.named(right)};
}

StereoTopics choose_stereo_topic(const std::string& bag, const std::vector<BagTopic>& topics,
                                 const std::string& name) {
    const Choice choice(bag, topics);
    return {name.empty() ? choice.only_one() : choice.named(name), std::nullopt};
}

std::string camera_info_topic(const std::string& image_topic) {
    const std::string_view topic = without_transport(image_topic);
    const std::size_t slash = topic.rfind('/');
    const std::string_view folder =
        slash == std::string_view::npos ? std::string_view() : topic.substr(0, slash + 1);
    return std::string(folder) + "camera_info";
}

bool is_rectified_topic(const std::string& image_topic) {
    const std::vector<std::string_view> parts = split(without_transport(image_topic), '/');
    return std::any_of(parts.begin(), parts.end(), [](std::string_view part) {
        return part == "rect" || part.starts_with("image_rect");
    });
}

}  // namespace defrec::cli
