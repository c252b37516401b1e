#include "common/config/model_keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::config {

bool ModelName::is_shared_library() const {
  constexpr std::string_view kEnding = ".so";
  return name.size() > kEnding.size() &&
         name.compare(name.size() - kEnding.size(), kEnding.size(), kEnding) == 0;
}

std::filesystem::path ModelName::find_library(const std::filesystem::path& folder) const {
  return is_shared_library() ? folder / name : std::filesystem::path();
}

namespace {

/// The keys of every shared library. A plant in a library may have an attitude.
template <class Section>
class LibraryKeys : public OwnKeys<Section, LibraryParameters> {
  bool has_attitude(const Section&) const override { return true; }
};

}  // namespace

template <class Section>
const ModelKeys<Section>& find_model_keys(const ModelRegistry<Section>& registry,
                                          const ModelName& model) {
  static const LibraryKeys<Section> kLibraryKeys;
  return model.is_shared_library() ? kLibraryKeys : *registry.at(model.name);
}

template const ModelKeys<Plant>& find_model_keys(const ModelRegistry<Plant>&, const ModelName&);
template const ModelKeys<Autopilot>& find_model_keys(const ModelRegistry<Autopilot>&,
                                                     const ModelName&);
template const ModelKeys<Controller>& find_model_keys(const ModelRegistry<Controller>&,
                                                      const ModelName&);

}  // namespace sls::config
