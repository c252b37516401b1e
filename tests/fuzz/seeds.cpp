/// Writes the documents of a table as seeds: seeds TABLE FOLDER.
#include <cstdlib>
#include <filesystem>

#include "tests/support/edited_documents.hpp"

int main(int count, char** words) {
  if (count != 3) return EXIT_FAILURE;
  std::filesystem::create_directories(words[2]);
  int number = 0;
  for (const auto& document : sls::test::read_edited_documents(words[1]))
    std::ofstream(std::filesystem::path(words[2]) / std::to_string(number++), std::ios::binary)
        << document.text;
}
