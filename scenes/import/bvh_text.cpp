// The text of a BVH file, checked before assimp sees it.
#include "scenes/import/bvh_text.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"

#include <charconv>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

namespace cab::scenes {
namespace {

// assimp reads and frees a hierarchy by recursion, so its depth is limited.
constexpr std::size_t kMaxDepth = 1024;
// assimp collects the digits before the point in 64 bits, and reads 0 without an error when they do not fit.
constexpr std::size_t kMaxIntegerDigits = 18;
constexpr std::size_t kShownCharacters = 40;
constexpr std::size_t kMaxNameBytes = 1000;  // names are in messages and in every hit
constexpr std::size_t kNamesInNote = 6;
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

// A line of the motion and how many values it has.
struct Row {
  std::size_t line = 0;
  std::size_t count = 0;
};

// Finds out whether the frames end where lines end. One value too many or too few moves all later values to other
// channels, and then the frames end inside lines.
class Rows {
 public:
  Rows(std::size_t frame_count, std::size_t frame_values) : frame_count_(frame_count), frame_values_(frame_values) {}

  void add_value(std::size_t line) {
    if (line != row_.line) end_row();
    row_.line = line;
    ++row_.count;
  }

  void end_row() {
    if (row_.count == 0) return;
    ++row_count_;
    full_count_ += row_.count == frame_values_ ? 1 : 0;
    if (broken_.line == 0) {
      if (values_in_frame_ == 0) begin_ = row_;
      values_in_frame_ += row_.count;
      if (values_in_frame_ > frame_values_) broken_ = begin_;
      if (values_in_frame_ == frame_values_) {
        values_in_frame_ = 0;
        ++ended_count_;
      }
    }
    row_ = {};
  }

  // Most lines are whole frames, or there are as many lines as frames.
  bool are_frames() const { return 2 * full_count_ > row_count_ || row_count_ == frame_count_; }
  // Where the first frame begins that ends inside a line. Its line is 0 if there is no such frame.
  const Row& broken() const { return broken_; }
  // Where the frame begins at which the file ends. Its line is 0 if the file ends with a frame.
  Row cut() const { return values_in_frame_ == 0 ? Row() : begin_; }
  bool first_frame_ends_a_line() const { return ended_count_ > 0; }

 private:
  std::size_t frame_count_, frame_values_;
  Row row_;    // the line that is being read
  Row begin_;  // the first line of the frame that is being read
  Row broken_;
  std::size_t values_in_frame_ = 0;
  std::size_t row_count_ = 0, full_count_ = 0, ended_count_ = 0;
};

class Reader {
 public:
  Reader(std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  BvhText read() {
    expect("HIERARCHY");
    expect("ROOT");
    read_hierarchy();
    note_equal_names();
    expect("MOTION");
    read_motion();
    return std::move(text_);
  }

 private:
  // A token is a run of non-blanks. A brace is a token of its own.
  struct Token {
    std::size_t begin = 0;
    std::size_t size = 0;
    std::size_t line = 0;
    std::size_t column = 0;  // from 1; 0 if the line begins with another token
  };

  [[noreturn]] void fail(std::size_t line, const std::string& reason) const {
    throw ImportError(path_ + ": line " + std::to_string(line) + ": " + reason);
  }

  std::string shown(const Token& token) const {
    if (token.size == 0) return "the end of the file";
    return "\"" + printable(view(token).substr(0, kShownCharacters)) + (token.size > kShownCharacters ? "...\"" : "\"");
  }

  std::string_view view(const Token& token) const { return std::string_view(bytes_).substr(token.begin, token.size); }

  bool at_comment() const {
    return bytes_[at_] == '#' || (bytes_[at_] == '/' && at_ + 1 < bytes_.size() && bytes_[at_ + 1] == '/');
  }

  // Goes to the next token. assimp knows no comments, so they become blanks.
  void skip_blanks() {
    while (at_ < bytes_.size()) {
      if (is_blank(bytes_[at_])) {
        const bool ends_line = bytes_[at_++] == '\n';
        line_ += ends_line ? 1 : 0;
        if (ends_line) line_begin_ = at_;
        at_line_begin_ = at_line_begin_ || ends_line;
      } else if (at_comment()) {
        for (; at_ < bytes_.size() && bytes_[at_] != '\n'; ++at_) bytes_[at_] = ' ';
      } else {
        return;
      }
    }
  }

  Token next() {
    skip_blanks();
    Token token;
    token.begin = at_;
    token.line = line_;
    token.column = at_line_begin_ ? at_ - line_begin_ + 1 : 0;
    at_line_begin_ = false;
    while (at_ < bytes_.size() && !is_blank(bytes_[at_])) {
      const bool is_brace = bytes_[at_] == '{' || bytes_[at_] == '}';
      if (is_brace && token.size > 0) break;
      ++at_;
      ++token.size;
      if (is_brace) break;
    }
    return token;
  }

  // True if the token is the word in any case.
  bool matches(const Token& token, std::string_view word) const { return same_word(view(token), word); }

  void expect(std::string_view word) {
    const Token token = next();
    if (!matches(token, word)) fail(token.line, "expected \"" + std::string(word) + "\", found " + shown(token));
  }

  // Reads a word and a colon. Blanks may stand before the colon, and may be missing after it.
  void expect_label(std::string_view word) {
    const Token token = next();
    const auto wrong = [&] { fail(token.line, "expected \"" + std::string(word) + ":\", found " + shown(token)); };
    if (!same_word(view(token).substr(0, word.size()), word)) wrong();
    at_ = token.begin + word.size();
    skip_blanks();
    if (at_ == bytes_.size() || bytes_[at_] != ':') wrong();
    ++at_;
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

  // The rest of the line up to an opening brace or a comment behind a blank, without the blanks around it. "Joint#1" is
  // a name, and so may be "#1".
  std::string_view read_rest_of_line(bool is_name) {
    while (at_ < bytes_.size() && is_blank(bytes_[at_]) && bytes_[at_] != '\n') ++at_;
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && bytes_[at_] != '\n' && bytes_[at_] != '{' &&
           !((at_ > begin || !is_name) && is_blank(bytes_[at_ - 1]) && at_comment()))
      ++at_;
    std::size_t end = at_;
    while (end > begin && is_blank(bytes_[end - 1])) --end;
    return std::string_view(bytes_).substr(begin, end - begin);
  }

  std::string read_name() {
    const std::string_view text = read_rest_of_line(true);
    if (text.empty()) fail(line_, "expected the name of a joint");
    if (text.front() == '}') fail(line_, "expected the name of a joint, found \"}\"");
    if (text.size() > kMaxNameBytes)
      fail(line_, "the name of a joint is longer than " + std::to_string(kMaxNameBytes) + " bytes");
    return printable(text);
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
    if (!is_end_site) ++uses_of_name_[name];
    joint.name = std::move(name);
    OpenJoint block;
    block.joint = text_.joints.size();
    block.line = line_;
    const Token brace = next();
    if (!matches(brace, "{")) fail(brace.line, "expected \"{\" after " + joint.name + ", found " + shown(brace));
    block.column = brace.column;
    open_.push_back(block);
    text_.joints.push_back(std::move(joint));
  }

  void close(const Token& brace) {
    const OpenJoint& block = open_.back();
    const BvhJoint& joint = text_.joints[block.joint];
    if (!block.has_offset) fail(brace.line, joint.name + " has no OFFSET");
    if (doubt_.empty() && block.column > 0 && brace.column > 0 && block.column != brace.column)
      doubt_ = "; the braces of " + joint.name + ", which began at line " + std::to_string(block.line) +
               ", do not line up at line " + std::to_string(brace.line);
    open_.pop_back();
  }

  // Which joint is open, and the first joint whose closing brace is indented as that of another one.
  std::string where() const {
    return "; " + text_.joints[open_.back().joint].name + ", which began at line " + std::to_string(open_.back().line) +
           ", is open" + doubt_;
  }

  void note_equal_names() {
    std::string names;
    std::size_t count = 0;
    for (const auto& [name, uses] : uses_of_name_) {
      if (uses == 1) continue;
      if (++count <= kNamesInNote) names += (count > 1 ? ", " : "") + name + " (" + std::to_string(uses) + " times)";
    }
    if (count > kNamesInNote) names += " and " + std::to_string(count - kNamesInNote) + " more";
    if (count > 0) text_.notes.push_back("joints with the same name: " + names);
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
        close(token);
      } else if (joint.is_end_site) {
        fail(token.line, "expected OFFSET or \"}\" in an end site, found " + shown(token) + where());
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
        read_rest_of_line(false);  // a name of its own
        open(name, true);
      } else {
        fail(token.line, "expected OFFSET, CHANNELS, JOINT, End Site or \"}\", found " + shown(token) + where());
      }
    }
  }

  void read_motion() {
    expect_label("Frames");
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
    expect_label("Time");
    const std::size_t time_line = line_;
    text_.frame_seconds = read_number("frame time", kMaxImportValue);
    if (!(text_.frame_seconds > 0)) fail(time_line, "the frame time must be above 0");
    if (text_.frame_seconds < kMinFrameSeconds || text_.frame_seconds > kMaxFrameSeconds) {
      fail(time_line, "the frame time must be between a microsecond and an hour");
    }

    const std::size_t values_begin = at_;
    read_values();
    bytes_.replace(0, values_begin, header_for_assimp());
  }

  void read_values() {
    const std::size_t value_count = text_.frame_count * text_.channel_count;
    text_.values.reserve(value_count);
    Rows rows(text_.frame_count, text_.channel_count);
    std::size_t last_line = 0;
    for (skip_blanks(); at_ < bytes_.size() && text_.values.size() < value_count; skip_blanks()) {
      last_line = line_;
      rows.add_value(line_);
      text_.values.push_back(read_number("motion value", kMaxImportValue));
    }
    const bool is_cut = text_.values.size() < value_count;
    const bool has_more = at_ < bytes_.size();
    for (; at_ < bytes_.size() && line_ == last_line; skip_blanks()) {
      rows.add_value(line_);
      next();
    }
    rows.end_row();
    check_rows(rows, has_more);
    if (is_cut)
      fail(line_, "the file ends in frame " + std::to_string(text_.values.size() / text_.channel_count + 1) + " of " +
                      std::to_string(text_.frame_count));
    if (at_ < bytes_.size())
      text_.notes.push_back("line " + std::to_string(line_) +
                            " and what follows lie behind the last frame and are not read");
  }

  // Refuses values that are in other channels than those that the lines of the file show.
  void check_rows(const Rows& rows, bool has_more) const {
    const auto found = [&](const Row& row) {
      return std::to_string(row.count) + " values, a frame has " + std::to_string(text_.channel_count);
    };
    const Row& row = rows.broken();
    if (rows.are_frames() && row.line > 0) fail(row.line, found(row));
    if (rows.are_frames() && rows.cut().line > 0) fail(rows.cut().line, found(rows.cut()));
    if (row.line == 0) return;
    if (rows.first_frame_ends_a_line())
      fail(row.line, "the frame that begins here does not end where a line ends, as those before it do");
    if (has_more)
      fail(row.line,
           found(row) + ", and there are more values than in " + std::to_string(text_.frame_count) + " frames");
  }

  // What assimp reads instead of the file's hierarchy. Its names, offsets and end sites are not asked for.
  std::string header_for_assimp() const {
    std::string header = "HIERARCHY\n";
    std::vector<std::int32_t> open;
    const auto close_until = [&](std::int32_t parent) {
      for (; !open.empty() && open.back() != parent; open.pop_back()) header += "}\n";
    };
    for (std::size_t j = 0; j < text_.joints.size(); ++j) {
      const BvhJoint& joint = text_.joints[j];
      if (joint.is_end_site) continue;
      close_until(joint.parent);
      header += std::string(j == 0 ? "ROOT" : "JOINT") + " j\n{\nOFFSET 0 0 0\n";
      header += "CHANNELS " + std::to_string(joint.channels.size());
      for (const BvhChannel channel : joint.channels)
        header += std::string(" ") + kChannelNames[static_cast<std::size_t>(channel)];
      header += "\n";
      open.push_back(static_cast<std::int32_t>(j));
    }
    close_until(-1);
    return header + "MOTION\nFrames: " + std::to_string(text_.frame_count) + "\nFrame Time: 1";
  }

  struct OpenJoint {
    std::size_t joint = 0;
    std::size_t line = 0;    // of its name
    std::size_t column = 0;  // of its brace
    bool has_offset = false;
    bool has_channels = false;
    bool has_children = false;
  };

  std::string& bytes_;
  const std::string& path_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::size_t line_begin_ = 0;
  bool at_line_begin_ = true;  // no token of the line has been read
  BvhText text_;
  std::vector<OpenJoint> open_;
  std::string doubt_;
  std::map<std::string, std::size_t> uses_of_name_;
};

}  // namespace

BvhText check_bvh_text(std::string& bytes, const std::string& path) { return Reader(bytes, path).read(); }

}  // namespace cab::scenes
