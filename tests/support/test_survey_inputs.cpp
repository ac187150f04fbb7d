#include "support/programs/survey_inputs.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_survey_inputs {

namespace {

std::vector<survey_input> survey_inputs(const std::vector<std::filesystem::path>& paths) {
  auto inputs = named_inputs(paths);
  hash_inputs(inputs);
  return inputs;
}

}  // namespace

TEST_CASE("inputs of a survey are named by their files, and by folders where two have one name") {
  const temporary_directory directory;
  for (const char* folder : {"one", "two", "two/deep"}) std::filesystem::create_directory(directory / folder);
  const std::vector<std::filesystem::path> paths = {directory.file("one/a.ply", "1"),
                                                    directory.file("two/a.ply", "2"),
                                                    directory.file("two/deep/b.las", "3")};
  std::vector<std::string> names;
  for (const auto& path : paths)
    for (const survey_input& input : survey_inputs(paths))
      if (input.path == path) names.push_back(input.name);
  CHECK(names == std::vector<std::string>{"one__a", "two__a", "b"});
}

TEST_CASE("inputs of a survey come in the order of their contents, whatever the order they were named in") {
  const temporary_directory directory;
  std::vector<std::filesystem::path> paths;
  for (int i = 0; i < 20; ++i)
    paths.push_back(directory.file(std::to_string(i) + ".ply", std::string(std::size_t(i), 'x')));
  const auto order = [](const std::vector<survey_input>& inputs) {
    std::vector<std::string> names;
    for (const survey_input& input : inputs) names.push_back(input.name);
    return names;
  };
  const auto once = order(survey_inputs(paths));
  std::reverse(paths.begin(), paths.end());
  paths.push_back(paths.front());  // named twice
  CHECK(order(survey_inputs(paths)) == once);
  CHECK(once.size() == 20);
}

TEST_CASE("of inputs of one content the later names say which they are the same as") {
  const temporary_directory directory;
  const auto inputs = survey_inputs({directory.file("c.ply", "same"), directory.file("a.ply", "same"),
                                     directory.file("b.ply", "same"), directory.file("d.ply", "other")});
  for (const survey_input& input : inputs) {
    CAPTURE(input.name);
    CHECK(input.same_as ==
          (input.name == "b" || input.name == "c" ? std::optional<std::string>("a") : std::nullopt));
  }
}

TEST_CASE("an input that cannot be read has a reason, and others of one name are refused") {
  const temporary_directory directory;
  const auto inputs = survey_inputs({directory / "absent.ply"});
  REQUIRE(inputs.size() == 1);
  CHECK_THAT(inputs[0].error, Catch::Contains("absent.ply"));
  CHECK_FALSE(inputs[0].same_as);
  const auto a = directory.file("a.ply", "1"), b = directory.file("a.las", "2");
  CHECK_THAT(error_of([&] {
               survey_inputs({a, b});
             }),
             Catch::Contains("same name") && Catch::Contains("Rename"));
}

TEST_CASE("the hash of a content depends on every byte and on its length") {
  const temporary_directory directory;
  std::string bytes(4097, '\0');
  const auto hash = [&](const std::string& content) { return content_hash(directory.file("f", content)); };
  const auto before = hash(bytes);
  CHECK(hash(bytes) == before);
  for (const std::size_t i : {0u, 1u, 7u, 8u, 4095u, 4096u}) {
    CAPTURE(i);
    std::string changed = bytes;
    changed[i] = 1;
    CHECK(hash(changed) != before);
  }
  CHECK(hash(bytes + '\0') != before);
  CHECK(hash("") != hash(std::string(1, '\0')));
}

TEST_CASE("the parts of a survey hold each input once, and what is no part is refused") {
  const temporary_directory directory;
  std::vector<std::filesystem::path> paths;
  for (int i = 0; i < 10; ++i) paths.push_back(directory.file(std::to_string(i) + ".ply", std::to_string(i)));
  std::vector<std::string> names;
  for (const char* part : {"1/3", "2/3", "3/3"})
    for (const survey_input& input : part_of(survey_inputs(paths), parse_part(part)))
      names.push_back(input.name);
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"0", "1", "2", "3", "4", "5", "6", "7", "8", "9"});
  CHECK(part_of(survey_inputs(paths), parse_part("7/20")).size() == 1);
  CHECK(parse_part("").count == 1);
  CHECK(name_of(parse_part("2/7")) == "2_of_7");
  CHECK(part_of(survey_inputs(paths), parse_part("11/20")).empty());
  for (const char* wrong : {"1", "0/3", "4/3", "1/0", "a/b", "1/3x", "-1/3", "1:3"}) {
    CAPTURE(wrong);
    CHECK_THROWS_WITH(parse_part(wrong), Catch::Contains("I/N"));
  }
}

}  // namespace globalmatch::support::test_survey_inputs
