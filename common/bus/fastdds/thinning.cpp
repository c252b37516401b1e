#include "common/bus/fastdds/thinning.hpp"

#include <fastdds/dds/topic/IContentFilter.hpp>
#include <fastdds/dds/topic/IContentFilterFactory.hpp>

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <atomic>
#include <charconv>
#include <string_view>

#include "common/bus/fastdds/facts_of.hpp"

namespace sls::bus {
namespace {

constexpr std::uint32_t kMostSamples = 1'000;
constexpr std::uint32_t kMostMilliseconds = 10'000;

std::optional<std::uint32_t> read_number(std::string_view text, std::uint32_t most) {
  std::uint32_t number = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || number < 1 || number > most) return std::nullopt;
  return number;
}

// The classes of Fast DDS 2 that these derive from have no virtual destructor. Factories delete
// filters as what they made, and our factory is never deleted.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"

class ThinningFilter final : public dds::IContentFilter {
 public:
  explicit ThinningFilter(const Share& share) : thinning_(share) {}

  /// Called once for each sample, under the lock of the writer, or of the reader.
  bool evaluate(const SerializedPayload&, const FilterSampleInfo&, const GUID_t&) const override {
    return thinning_.passes(std::chrono::steady_clock::now());
  }

 private:
  mutable Thinning thinning_;
};

struct ThinningFactory final : dds::IContentFilterFactory {
  ReturnCode create_content_filter(const char*, const char*, const dds::TopicDataType*,
                                   const char* expression, const ParameterSeq& parameters,
                                   dds::IContentFilter*& filter) override {
    std::vector<std::string> texts;
    for (ParameterSeq::size_type i = 0; i < parameters.length(); ++i)
      texts.emplace_back(parameters[i]);
    // Fast DDS passes no expression where only parameters change.
    const auto share = read_share(expression ? expression : kThinningExpression, texts);
    if (!share) return kBadParameter;
    delete static_cast<ThinningFilter*>(filter);
    filter = new ThinningFilter(*share);
    return kOk;
  }
  ReturnCode delete_content_filter(const char*, dds::IContentFilter* filter) override {
    delete static_cast<ThinningFilter*>(filter);
    return kOk;
  }
};

#pragma GCC diagnostic pop

}  // namespace

std::vector<std::string> to_parameters(const Share& share) {
  return {std::to_string(share.most), std::to_string(share.window.count())};
}

std::optional<Share> read_share(const std::string& expression,
                                const std::vector<std::string>& parameters) {
  if (expression != kThinningExpression || parameters.size() != 2) return std::nullopt;
  const auto most = read_number(parameters[0], kMostSamples);
  const auto window = read_number(parameters[1], kMostMilliseconds);
  if (!most || !window) return std::nullopt;
  return Share{*most, std::chrono::milliseconds(*window)};
}

bool know_thinning(dds::DomainParticipant& participant) {
  static ThinningFactory factory;  // outlives the participants
  return is_ok(participant.register_content_filter_factory(kThinningClass, &factory));
}

dds::ContentFilteredTopic* make_share_of(dds::Topic& topic, const Share& share) {
  // A writer says for each signature of a filter, and the name is part of it, whether a sample
  // passed. With equal names a reader would take what another reader's filter chose.
  static std::atomic<std::uint64_t> count{0};
  auto& participant = *topic.get_participant();
  const PeerId self = to_peer(participant.get_instance_handle());
  return participant.create_contentfilteredtopic(
      fmt::format("{} of {:02x} {}", topic.get_name(), fmt::join(self.bytes, ""), ++count), &topic,
      kThinningExpression, to_parameters(share), kThinningClass);
}

}  // namespace sls::bus
