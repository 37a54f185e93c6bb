// The text of a BVH file, checked before assimp sees it.
#include "scenes/import/bvh_text.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"

#include <charconv>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

namespace cab::scenes {
namespace {

// assimp reads and frees a hierarchy by recursion, so its depth is limited.
constexpr std::size_t kMaxDepth = 1024;
constexpr std::size_t kMaxJoints = 8192;
// assimp collects the digits before the point in 64 bits, and reads 0 without an error when they do not fit.
constexpr std::size_t kMaxIntegerDigits = 18;
constexpr std::size_t kShownCharacters = 40;
// assimp keeps the reciprocal of the frame time.
constexpr double kMinFrameSeconds = 1e-6;

constexpr std::array<const char*, 6> kChannelNames = {"Xposition", "Yposition", "Zposition",
                                                      "Xrotation", "Yrotation", "Zrotation"};

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_word(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (lower(a[i]) != lower(b[i])) return false;
  }
  return true;
}

class Reader {
 public:
  Reader(std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  BvhText read() {
    expect("HIERARCHY");
    expect("ROOT");
    read_hierarchy();
    expect("MOTION");
    read_motion();
    return std::move(text_);
  }

 private:
  // A token is a run of non-blanks. As in assimp, a brace at its beginning is a token of its own.
  struct Token {
    std::size_t begin = 0;
    std::size_t size = 0;
    std::size_t line = 0;
  };

  [[noreturn]] void fail(std::size_t line, const std::string& reason) const {
    throw ImportError(path_ + ": line " + std::to_string(line) + ": " + reason);
  }

  std::string shown(const Token& token) const {
    if (token.size == 0) return "the end of the file";
    return "\"" + printable(view(token).substr(0, kShownCharacters)) + (token.size > kShownCharacters ? "...\"" : "\"");
  }

  std::string_view view(const Token& token) const { return std::string_view(bytes_).substr(token.begin, token.size); }

  void skip_blanks() {
    for (; at_ < bytes_.size() && is_blank(bytes_[at_]); ++at_) {
      if (bytes_[at_] == '\n') ++line_;
    }
  }

  Token next() {
    skip_blanks();
    Token token;
    token.begin = at_;
    token.line = line_;
    while (at_ < bytes_.size() && !is_blank(bytes_[at_])) {
      ++at_;
      ++token.size;
      if (token.size == 1 && (bytes_[token.begin] == '{' || bytes_[token.begin] == '}')) break;
    }
    return token;
  }

  // True if the token is the word in any case. The bytes then get the word's own case.
  bool matches(const Token& token, std::string_view word) {
    if (!same_word(view(token), word)) return false;
    bytes_.replace(token.begin, token.size, word);
    return true;
  }

  void expect(std::string_view word) {
    const Token token = next();
    if (!matches(token, word)) fail(token.line, "expected \"" + std::string(word) + "\", found " + shown(token));
  }

  double read_number(const char* what, double limit) {
    const Token token = next();
    std::string_view digits = view(token);
    const auto bad = [&](const char* reason) { fail(token.line, std::string(what) + " " + shown(token) + reason); };
    if (token.size == 0) fail(token.line, std::string("the file ends where ") + what + " should be");
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::invalid_argument || end != digits.data() + digits.size()) bad(" is not a number");
    if (error == std::errc::result_out_of_range) bad(" is out of range");
    if (!std::isfinite(value)) bad(" is not finite");
    if (std::fabs(value) > limit) bad(" is out of range");
    if (digits.find_first_not_of("-0123456789") > kMaxIntegerDigits && digits.size() > kMaxIntegerDigits)
      bad(" has too many digits");
    return value;
  }

  // The rest of the line up to an opening brace. Blanks inside become "_" for assimp.
  std::string read_name() {
    while (at_ < bytes_.size() && is_blank(bytes_[at_]) && bytes_[at_] != '\n') ++at_;
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && bytes_[at_] != '\n' && bytes_[at_] != '{') ++at_;
    std::size_t end = at_;
    while (end > begin && is_blank(bytes_[end - 1])) --end;
    if (end == begin) fail(line_, "expected the name of a joint");
    if (end == at_ && at_ < bytes_.size() && bytes_[at_] == '{')
      fail(line_, "expected a blank between the name of a joint and \"{\"");
    std::string name = printable(std::string_view(bytes_).substr(begin, end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      if (is_blank(bytes_[i])) bytes_[i] = '_';
    }
    if (bytes_[begin] == '}') fail(line_, "expected the name of a joint, found \"}\"");
    // assimp would cut off longer names.
    if (name.size() > 1000) fail(line_, "the name of a joint is longer than 1000 characters");
    return name;
  }

  void read_offset(BvhJoint& joint) {
    for (double& component : joint.offset) component = read_number("OFFSET value", kMaxImportValue);
  }

  void read_channels(BvhJoint& joint) {
    const std::size_t line = line_;
    const double count = read_number("channel count", kMaxImportValue);
    if (count != std::floor(count) || count < 0 || count > 6) fail(line, "a joint has 0 to 6 channels");
    std::array<int, 6> uses = {};
    for (int c = 0; c < static_cast<int>(count); ++c) {
      const Token token = next();
      std::size_t channel = 0;
      while (channel < kChannelNames.size() && !matches(token, kChannelNames[channel])) ++channel;
      if (channel == kChannelNames.size())
        fail(token.line, "expected a channel such as Xrotation, found " + shown(token));
      if (++uses[channel] > 1 && channel < 3) fail(token.line, "the channel " + shown(token) + " is given twice");
      joint.channels.push_back(static_cast<BvhChannel>(channel));
    }
    if (uses[3] + uses[4] + uses[5] > 3) fail(line, "a joint has at most three rotation channels");
    joint.first_value = text_.channel_count;
    text_.channel_count += joint.channels.size();
  }

  // Opens a joint or end site after its name and before its block.
  void open(std::string name, bool is_end_site) {
    if (text_.joints.size() == kMaxJoints) fail(line_, "more than " + std::to_string(kMaxJoints) + " joints");
    if (open_.size() == kMaxDepth) fail(line_, "joints are nested more than " + std::to_string(kMaxDepth) + " deep");
    BvhJoint joint;
    joint.parent = open_.empty() ? -1 : static_cast<std::int32_t>(open_.back().joint);
    joint.is_end_site = is_end_site;
    if (!is_end_site && !names_.insert(name).second) text_.notes.push_back("more than one joint is named " + name);
    joint.name = std::move(name);
    expect("{");
    open_.push_back({text_.joints.size(), line_});
    text_.joints.push_back(std::move(joint));
  }

  // Reads from the root's name to its closing brace, without recursion.
  void read_hierarchy() {
    open(read_name(), false);
    while (!open_.empty()) {
      OpenJoint& block = open_.back();
      BvhJoint& joint = text_.joints[block.joint];
      const Token token = next();
      if (matches(token, "OFFSET")) {
        if (block.has_offset) fail(token.line, joint.name + " has a second OFFSET");
        block.has_offset = true;
        read_offset(joint);
      } else if (matches(token, "}")) {
        if (!block.has_offset) fail(token.line, joint.name + " has no OFFSET");
        open_.pop_back();
      } else if (joint.is_end_site) {
        fail(token.line, "expected OFFSET or \"}\" in an end site, found " + shown(token));
      } else if (matches(token, "CHANNELS")) {
        // assimp keeps a reference to the joint that its children invalidate: CHANNELS after a child would write to
        // freed memory.
        if (block.has_children) fail(token.line, "CHANNELS of " + joint.name + " after a child joint");
        if (block.has_channels) fail(token.line, joint.name + " has a second CHANNELS");
        block.has_channels = true;
        read_channels(joint);
      } else if (matches(token, "JOINT")) {
        block.has_children = true;
        open(read_name(), false);
      } else if (matches(token, "End")) {
        block.has_children = true;
        const std::string name = joint.name + "/End";
        expect("Site");
        open(name, true);
      } else if (token.size == 0) {
        fail(token.line, "the file ends inside " + joint.name + ", which began at line " + std::to_string(block.line));
      } else {
        fail(token.line, "expected OFFSET, CHANNELS, JOINT, End Site or \"}\", found " + shown(token));
      }
    }
  }

  void read_motion() {
    expect("Frames:");
    const std::size_t frames_line = line_;
    const double frames = read_number("frame count", 1e18);
    if (frames < 1 || frames != std::floor(frames))
      fail(frames_line, "the frame count must be a whole number of at least 1");
    if (text_.channel_count == 0) fail(frames_line, "no joint has channels: there is no motion");
    if (frames * static_cast<double>(text_.channel_count) * 2 > static_cast<double>(bytes_.size())) {
      fail(frames_line, "the file is too short for its frame count: that many frames of " +
                            std::to_string(text_.channel_count) + " values do not fit in " +
                            std::to_string(bytes_.size()) + " bytes");
    }
    if (frames * static_cast<double>(text_.joints.size()) > static_cast<double>(kMaxJointFrames)) {
      fail(frames_line, "frames x joints is more than " + std::to_string(kMaxJointFrames));
    }
    text_.frame_count = static_cast<std::uint32_t>(frames);

    expect("Frame");
    expect("Time:");
    const std::size_t time_line = line_;
    text_.frame_seconds = read_number("frame time", kMaxImportValue);
    if (!(text_.frame_seconds > 0)) fail(time_line, "the frame time must be above 0");
    if (text_.frame_seconds < kMinFrameSeconds || text_.frame_seconds > kMaxFrameSeconds) {
      fail(time_line, "the frame time must be between a microsecond and an hour");
    }

    const std::size_t value_count = text_.frame_count * text_.channel_count;
    text_.values.reserve(value_count);
    for (std::size_t v = 0; v < value_count; ++v) {
      const std::size_t frame = v / text_.channel_count;
      skip_blanks();
      if (at_ == bytes_.size()) {
        fail(line_, "the file ends in frame " + std::to_string(frame + 1) + " of " + std::to_string(text_.frame_count));
      }
      text_.values.push_back(read_number("motion value", kMaxImportValue));
    }
    skip_blanks();
    if (at_ < bytes_.size()) {
      text_.notes.push_back("line " + std::to_string(line_) +
                            " and what follows lie behind the last frame and are not read");
    }
  }

  struct OpenJoint {
    std::size_t joint = 0;
    std::size_t line = 0;
    bool has_offset = false;
    bool has_channels = false;
    bool has_children = false;
  };

  std::string& bytes_;
  const std::string& path_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  BvhText text_;
  std::vector<OpenJoint> open_;
  std::set<std::string> names_;
};

}  // namespace

BvhText check_bvh_text(std::string& bytes, const std::string& path) { return Reader(bytes, path).read(); }

}  // namespace cab::scenes
