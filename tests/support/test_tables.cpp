// Spellings of tables that people have: each is read, or refused with its header.
#include "support/table.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/scan_files.hpp"
#include "support/stem_files.hpp"

namespace globalmatch::support::test_tables {

namespace {

const points two_points = {{1.5, -2, 3}, {4, 5.25, -6}};

void require_scan(const std::string& text) {
  const temporary_directory directory;
  INFO(text);
  const points read = read_scan(directory.file("scan", text));
  REQUIRE(read.size() == 2);
  CHECK((read[0] - two_points[0]).norm() < 1e-9);
  CHECK((read[1] - two_points[1]).norm() < 1e-9);
}

void require_refused(const std::string& text, const std::string& problem) {
  const temporary_directory directory;
  INFO(text);
  require_error(directory.file("scan", text), read_scan, problem, "");
}

std::string in_utf16(const std::string& text, bool big_endian) {
  std::string bytes = big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) {
    if (big_endian) bytes += '\0';
    bytes += c;
    if (!big_endian) bytes += '\0';
  }
  return bytes;
}

void require_map(const std::string& text) {
  const temporary_directory directory;
  INFO(text);
  const stem_table table = read_stems(directory.file("stems", text));
  REQUIRE(table.stems.size() == 2);
  CHECK(table.stems[0].x == 1.5);
  CHECK(table.stems[0].y == -2);
  CHECK(table.stems[1].x == 4);
  CHECK(table.stems[1].y == 5.25);
}

std::filesystem::path cases() {
  return std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "cases";
}

}  // namespace

TEST_CASE("columns are known by their names with units, prefixes and quotes, in any order") {
  const std::string rows = "\n7,1.5,-2,3\n8,4,5.25,-6\n";
  for (const char* header :
       {"id,X(m),Y(m),Z(m)", "time,x_m,y_m,z_m", "t,X [m],Y [m],Z [m]", "id,Easting,Northing,Height",
        "id,E,N,H", "id,east,north,elevation", "id,gx,gy,gz", "id,tree_x,tree_y,tree_z", "id,px,py,pz",
        "\"i\",\"Points:0\",\"Points:1\",\"Points:2\"", "i,Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2",
        "i,X Coordinate,Y Coordinate,Z Coordinate", "'i','x','y','z'", "i,utm_easting,utm_northing,alt",
        "FID,POINT_X,POINT_Y,POINT_Z", "i,Rechtswert,Hochwert,z", "i,X(meter),Y(meter),Z(meter)"})
    require_scan(header + rows);
  require_scan("N,E,H\n-2,1.5,3\n5.25,4,-6\n");
  require_scan("Point,Northing,Easting,Elevation\n1,-2,1.5,3\n2,5.25,4,-6\n");
  require_scan("P,N,E,Z,D\n1,-2,1.5,3,tree\n2,5.25,4,-6,tree\n");
  require_scan("x_utm,y_utm,x,y,z\n500000,1,1.5,-2,3\n500001,1,4,5.25,-6\n");
}

TEST_CASE("coordinates in other units become metres where the header names them") {
  require_scan("x(cm),y(cm),z(cm)\n150,-200,300\n400,525,-600\n");
  require_scan("x_mm,y_mm,z_mm\n1500,-2000,3000\n4000,5250,-6000\n");
  require_scan("x,y,z\nm,m,m\n1.5,-2,3\n4,5.25,-6\n");
  require_scan("x,y,z,i\ncm,cm,cm,\n150,-200,300,1\n400,525,-600,1\n");
}

TEST_CASE("decimal commas and thousands are understood where there is no doubt") {
  require_scan("X;Y;Z\n1,5;-2;3\n4;5,25;-6\n");
  require_scan("1,5 -2,0 3,0\n4,0 5,25 -6,0\n");
  require_scan("x\ty\tz\n1,5\t-2,0\t3,0\n4\t5,25\t-6\n");
  const temporary_directory directory;
  for (const char* text : {"x;y;z\n4,512,005.5;5,312,018.25;1.5\n", "x;y;z\n4.512.005,5;5.312.018,25;1,5\n"})
    CHECK(read_scan(directory.file("a", text)) == points{{4512005.5, 5312018.25, 1.5}});
}

TEST_CASE("comments, titles, counts, separators and empty rows around a table are passed over") {
  for (const char* sign : {"# ", "% ", "! ", "//"})
    require_scan(sign + std::string("scan 4\n1.5 -2 3\n4 5.25 -6\n"));
  require_scan("# id x y z\n# exported by crew\n1 1.5 -2 3\n2 4 5.25 -6\n");
  require_scan("sep=;\nx;y;z\n1.5;-2;3\n4;5.25;-6\n");
  require_scan("X Y Z\n2\n1.5 -2 3\n4 5.25 -6\n");
  require_scan("1\n1.5 -2 3\n1\n4 5.25 -6\n");
  require_scan("X;Y;Z\n1.5;-2;3;\n4;5.25;-6;\n;;;\n");
  require_scan("\"X\" \"Y\" \"Z\"\n\"1\" 1.5 -2 3\n\"2\" 4 5.25 -6\n");
  require_scan("\tX\tY\tZ\n0\t1.5\t-2\t3\n1\t4\t5.25\t-6\n");
  require_scan("note\tx\ty\tz\n\t1.5\t-2\t3\ndead wood\t4\t5.25\t-6\n");
}

TEST_CASE("a comment that names the columns is a header, or is refused with its text, but is never dropped") {
  require_scan("# time [s] x [m] y [m] z [m]\n0.5 1.5 -2 3\n0.6 4 5.25 -6\n");
  require_scan("# t (s), x (m), y (m), z (m)\n0.5 1.5 -2 3\n0.6 4 5.25 -6\n");
  require_scan("# columns: time x y z\n0.5 1.5 -2 3\n0.6 4 5.25 -6\n");
  require_scan("// Fields: time, x, y, z\n0.5,1.5,-2,3\n0.6,4,5.25,-6\n");
  require_scan("# FIELDS intensity x y z\n0.5 1.5 -2 3\n0.6 4 5.25 -6\n");
  require_scan("# columns: y x z\n-2 1.5 3\n5.25 4 -6\n");
  require_scan("# time,x,y,z\n0.5,1.5,-2,3,\n0.6,4,5.25,-6,\n");
  require_scan("# x (mm) y (mm) z (mm)\n1500 -2000 3000\n4000 5250 -6000\n");
  require_scan("# id x y\nid x y z\n1 1.5 -2 3\n2 4 5.25 -6\n");
  for (const std::string header : {"id x y z", "format: x y z"})
    require_refused("# " + header + "\n100 1.5 -2 3 tree\n101 4 5.25 -6 tree\n", "'" + header + "'");
  require_refused("# format: x y z\n1.5 -2 3 7\n4 5.25 -6 9\n", "'format: x y z'");
  require_refused("#y,x,z,intensity\n-2,1.5,3\n5.25,4,-6\n", "'y,x,z,intensity'");
  for (const std::string header :
       {"range azimuth elevation", "time x y", "azimuth, zenith, range", "x y intensity", "y x z in metres"})
    require_refused("% " + header + "\n1.5 -2 3\n4 5.25 -6\n", "'" + header + "'");
}

TEST_CASE("a comment that is a sentence is harmless") {
  for (const char* sentence :
       {"points with x, y and z in metres", "the columns are x y z", "scan of plot", "plot 7, east side",
        "exported from a scanner at the north end of the plot", "Date: 2020-05-01 12:30", "40 points", "x"})
    require_scan("# " + std::string(sentence) + "\n1.5 -2 3\n4 5.25 -6\n");
}

TEST_CASE("a row of a scan with another number of cells than its header is refused with its number") {
  std::string commas = "note,x,y,z,i\n", blanks = "t x y z i\n", behind = "x,y,z,note\n";
  for (int i = 0; i < 9; ++i) {
    commas += "oak,1,2,3,4\n";
    blanks += "1 1 2 3 4\n";
    behind += "1,2,3,\"a, b\"\n";
  }
  require_refused(commas + "1,2,10,20,30,5\n", "line 11 has 6 fields, but the header names 5");
  require_refused(blanks + "1 2 3 4\n", "line 11 has 4 fields, but the header names 5");
  require_refused(behind + "1,2,3,a,b\n", "line 11 has 5 fields, but the header names 4");
  require_scan("x,y,z,note\n1.5,-2,3,\"a, b\"\n4,5.25,-6,,\n");
}

TEST_CASE("components of other vectors than places are no coordinates") {
  for (const char* other : {"RGB", "Normals", "Velocity"}) {
    const auto names = [](const std::string& name, const char* sign) {
      return name + sign + "0," + name + sign + "1," + name + sign + "2";
    };
    for (const char* sign : {":", "_"}) {
      require_refused(names(other, sign) + "\n1,2,3\n", "names no columns");
      require_scan(names(other, sign) + "," + names("Points", sign) + "\n7,8,9,1.5,-2,3\n7,8,9,4,5.25,-6\n");
    }
  }
}

TEST_CASE("columns of one set are chosen, never a mixture") {
  require_scan("x,y,gx,gy,gz\n7,8,1.5,-2,3\n7,8,4,5.25,-6\n");
  require_scan("x,y,z,gx,gy,gz\n1.5,-2,3,7,8,9\n4,5.25,-6,7,8,9\n");
  require_scan("x,northing,z,easting\n7,-2,3,1.5\n7,5.25,-6,4\n");
  require_scan("easting,y,northing,z\n1.5,7,-2,3\n4,7,5.25,-6\n");
  require_scan("x,y (m),z\n1.5,-2,3\n4,5.25,-6\n");
  require_refused("x,northing,z\n1,2,3\n", "'x,northing,z'");
  require_refused("easting,northing,h,H\n1,2,3,4\n", "'easting,northing,h,H'");
}

TEST_CASE(
    "rows whose first cells all begin with the sign of a comment are rows, and one alone may be either") {
  for (const std::string sign : {"#", "%", "!"}) {
    require_map("tag,x,y\n" + sign + "1,1.5,-2\n" + sign + "2,4,5.25\n");
    require_map("tag;x;y\n" + sign + "1;1,5;-2\n" + sign + "2;4;5,25\n");
    require_map("tag,x,y\n1,1.5,-2\n" + sign + "3, 4, note\n2,4,5.25\n");
    require_scan("tag x y z\n" + sign + "1 1.5 -2 3\n" + sign + "2 4 5.25 -6\n");
    require_refused("tag x y z\n1 1.5 -2 3\n" + sign + "2 4 5.25 -6\n", "line 3 may be a row or a comment");
    require_refused("tag x y z\n" + sign + "1 1.5 -2 3\n2 4 5.25 -6\n", "line 3 has no sign in front");
  }
  require_map("x,y\n#1,2\n1.5,-2\n4,5.25\n");
}

TEST_CASE("what says that a coordinate of a stem is not known is understood in any spelling") {
  for (const char* word : {"-9999", "-9999.0", "-9999.000", "-99999", "-32768", "-1e4", "#N/A", "<NA>",
                           "n.a.", "NaN", "-3.40282346638529e+38"}) {
    const temporary_directory directory;
    INFO(word);
    const bool is_number = std::string(word) == "-1e4";
    const std::string rows = "1.5,-2," + std::string(word) + "\n4,5.25,1\n";
    CHECK(read_stems(directory.file("z", "x,y,z\n" + rows)).has_heights == is_number);
    const std::string missing = std::string(word) + ",2,3\n1.5,-2,3\n4,5.25,1\n";
    CHECK(read_stems(directory.file("x", "x,y,z\n" + missing)).stems.size() == (is_number ? 3u : 2u));
  }
  require_map("x;y;z;dbh\n1,5;-2;-9999,0;-999,0\n4;5,25;1;0,3\n");
  require_map("x (cm),y (cm),z (cm)\n-9999.0,-9999.0,1\n150,-200,-9999.0\n400,525,1\n");
}

TEST_CASE("identifiers or times first, without a header, are refused") {
  const std::string problem = "may be identifiers or times: '";
  require_refused("1001 1.5 -2.5 3\n1002 4.5 5.25 -6\n1003 5.5 5.25 -6\n", problem + "1001 1.5");
  require_refused("100,1.5,-2.5,3,TREE\n101,4.5,5.25,-6,TREE\n102,5.5,5.25,-6,TREE\n", problem);
  require_refused("5;1,5;-2,5;3,5\n8;4,5;5,25;-6\n11;5,5;5,25;-6\n", problem);
  require_refused("1600000000.00 1.5 -2 3\n1600000000.01 4 5.25 -6\n1600000000.02 4 5 -6\n", problem);
  const temporary_directory directory;
  for (const char* text : {"1 1.5 2\n2 1.5 2\n3 1.5 2\n", "1.0 1.5 2 9\n2.0 1.5 2 9\n3.0 1.5 2 9\n",
                           "1 5 2 9\n2 5 2 9\n3 5 2 9\n", "1 1.5 2 9\n1 1.5 3 9\n3 1.5 2 9\n"})
    CHECK(read_scan(directory.file("scan", text)).size() == 3);
}

TEST_CASE("integers first in a scan without a header are x unless they must be identifiers") {
  const temporary_directory directory;
  for (const char* text :
       {"10 1.25 2.5 90\n15 1.75 2.5 80\n17 2.5 2.75 81\n", "10 1.25 2 0.5\n15 1.75 2 0.25\n17 2.5 3 0.5\n",
        "1 -2 2.5 0.5\n2 -3 2.5 0.5\n3 -4 2.5 0.5\n"})
    CHECK(read_scan(directory.file("scan", text)).size() == 3);
  require_refused("5 1.5 -2.5 3.5\n8 4.5 5.25 -6\n11 5.5 5 -6.25\n", "may be identifiers or times");
}

TEST_CASE("commas of decimals beside commas between the columns are refused without a header") {
  const std::string problem = "its commas may be those of decimals: '10,125,100";
  require_refused("10,125,100,250,-5,500\n20,500,130,750,7,250\n16,516,123,662,-3,874\n", problem);
  const temporary_directory directory;
  for (const char* text : {"10,125,100,255,0,0\n20,500,130,255,0,0\n16,516,123,255,0,0\n",
                           "1,2,3,4,5,6\n1,2,3,4,5,6\n1,2,3,4,5,6\n",
                           "10,125,100,250,-5,50.5\n20,500,130,750,7,250\n16,516,123,662,-3,874\n"})
    CHECK(read_scan(directory.file("scan", text)).size() == 3);
}

TEST_CASE("rows of a scan whose coordinates are not known are not-a-number, which is said") {
  const temporary_directory directory;
  for (const char* row : {"-9999 -9999 -9999", "-9999.0 -9999.00 7", "NA NA NA", "NULL NULL NULL", "1 NA 3",
                          "-99999 -99999 -99999", "-32768 -32768 -32768", "1 2 -9999", "nan nan nan"}) {
    INFO(row);
    const auto path = directory.file("scan", "3\n1.5 -2 3\n" + std::string(row) + "\n4 5.25 -6\n");
    const scan_file scan = open_scan(path);
    REQUIRE(scan.size() == 3);
    CHECK((*(scan.begin() + 0) == two_points[0]));
    CHECK((*(scan.begin() + 1)).hasNaN());
    CHECK((*(scan.begin() + 2) == two_points[1]));
    REQUIRE(scan.header().notes.size() == 1);
    CHECK(scan.header().notes[0] == "1 rows have no known x, y and z, and are passed over");
  }
  const auto in_cm = directory.file("cm", "x (cm),y (cm),z (cm)\n-9999,-9999,-9999\n400,525,-600\n");
  CHECK((*open_scan(in_cm).begin()).hasNaN());
  require_scan("1.5 -2 3 -9999\n4 5.25 -6 -9999\n");
  const scan_file grid = open_scan(directory.file("grid", "-9998 5 1\n-9999 5 1\n-10000 5 1\n"));
  CHECK((*(grid.begin() + 1) == Eigen::Vector3d(-9999, 5, 1)));
  CHECK(grid.header().notes.empty());
}

TEST_CASE("two pairs of x and y in a stem map are refused, as within a quadrat and a plot") {
  const temporary_directory directory;
  for (const std::string header : {"quadrat,x,y,gx,gy", "x,y,z,gx,gy"})
    require_error(directory.file("a", header + "\n1,1.5,-2,21.5,18\n"), read_stems,
                  "two pairs of columns that may be x and y: '" + header + "'", "Name one column");
  require_map("x,y,gx,gy,gz\n7,8,1.5,-2,3\n7,8,4,5.25,-6\n");
  require_scan("x,y,z,px,py\n1.5,-2,3,7,8\n4,5.25,-6,7,8\n");
}

TEST_CASE("a diameter that is not known is understood in any unit") {
  const temporary_directory directory;
  const auto path = directory.file("a", "x,y,dbh (cm)\n1.5,-2,-999\n4,5.25,30\n");
  CHECK(read_stems(path).stems[1].radius == Approx(0.15));
}

TEST_CASE("names of coordinates in other languages and of surveyors are known") {
  for (const char* header : {"east,north,up", "e,n,u", "Este,Norte,Cota", "Ost,Nord,Hoehe",
                             "xcoord,ycoord,zcoord", "Ost,Nord,H\xC3\xB6he"})
    require_scan(header + std::string("\n1.5,-2,3\n4,5.25,-6\n"));
}

TEST_CASE("decimal commas in quotes, or in diameters or heights alone, are read") {
  require_scan("x,y,z\n\"1,5\",\"-2,0\",3\n4,\"5,25\",-6\n");
  require_map("x,y\n\"1,5\",\"-2\"\n4,\"5,25\"\n");
  require_refused("x,y,z\n\"1,500\",\"2,000\",3\n\"4,000\",\"5,250\",-6\n", "'1,500'");
  require_refused("x,y,z\n\"1,500.5\",\"2,00\",3\n\"4,000\",\"5,250\",-6\n", "line 2 has '2,00'");
  const temporary_directory directory;
  for (const char* text : {"id;x;y;dbh\n1;10;20;0,3\n2;11;21;0,5\n", "id x y dbh\n1 10 20 0,3\n2 11 21 0,5\n",
                           "id,x,y,dbh\n1,10,20,\"0,3\"\n2,11,21,\"0,5\"\n"}) {
    INFO(text);
    const stem_table table = read_stems(directory.file("stems", text));
    REQUIRE(table.stems.size() == 2);
    CHECK(table.stems[0].x == 10);
    CHECK(table.stems[0].radius == Approx(0.15));
  }
}

TEST_CASE("commas in heights beside points in coordinates are refused, for they may be those of thousands") {
  const temporary_directory directory;
  require_error(directory.file("a", "x;y;z\n1.5;-2;1,234\n4;5.25;1,235\n"), read_stems, "'1,234' in column z",
                "");
}

TEST_CASE("a cell too many behind an identifier is refused, never the name of a row") {
  const temporary_directory directory;
  require_error(directory.file("a", "id,x,y,dbh\n1,10,20,30,5\n2,11,21,31,5\n"), read_stems,
                "line 2 has 5 fields, but the header names 4", "");
}

TEST_CASE("a title with x and y between commas, above the header, is passed over") {
  require_map("Trees, x, y, of plot 7\nid,x,y\n1,1.5,-2\n2,4,5.25\n");
  require_scan("Scan of x, y, z values\nx,y,z\n1.5,-2,3\n4,5.25,-6\n");
}

TEST_CASE("a table may be separated by bars") {
  require_scan("sep=|\nx|y|z\n1.5|-2|3\n4|5.25|-6\n");
  require_scan("x|y|z\n1.5|-2|3\n4|5.25|-6\n");
  require_map("tag|x|y\n1|1,5|-2\n2|4|5,25\n");
}

TEST_CASE("where no line is cut the first is quoted") {
  require_refused("x:y:z\n1.5:-2:3\n4:5.25:-6\n",
                  "line 1 names no columns that are known to be x and y and z: 'x:y:z'");
}

TEST_CASE("a comment of prose that holds the words of coordinates is harmless") {
  for (const char* prose :
       {"Plot North East", "Plot 7 North East Bavaria", "Site X North", "Plot 7 elevation east north"})
    require_scan("# " + std::string(prose) + "\n1.5 -2 3\n4 5.25 -6\n");
  require_map("# Plot North East\nid,x,y\n7,1.5,-2\n8,4,5.25\n");
}

TEST_CASE("of stems x and y are taken, whatever the map coordinates beside them") {
  require_map("x,y,dbh,easting,northing,elevation\n1.5,-2,0.3,500,600,7\n4,5.25,0.3,501,601,8\n");
  require_map("easting,northing,elevation,x,y\n500,600,7,1.5,-2\n501,601,8,4,5.25\n");
}

TEST_CASE("a comment that says where something is names no columns") {
  for (const char* place : {"# x 691000 y 5334000 z 500", "# Offset: x 691000 y 5334000 z 500",
                            "# Position: lat 48.123 lon 11.456 alt 523.4"})
    require_scan(std::string(place) + "\n1.5 -2 3 7 8 9\n4 5.25 -6 7 8 9\n");
  require_map("# plot center: x 500 y 300\nid,x,y,dbh\n1,1.5,-2,0.3\n2,4,5.25,0.3\n");
  require_scan("# 4 columns: t x y z\n1 1.5 -2 3\n2 4 5.25 -6\n");
}

TEST_CASE("a row behind the sign of a comment and a blank is a comment") {
  require_map("tag,x,y\n1,1.5,-2\n# 3,7,8\n2,4,5.25\n");
  require_scan("t x y z\n1 1.5 -2 3\n// 7 8 9\n2 4 5.25 -6\n");
}

TEST_CASE("rows below more comments than are looked at are read as others are") {
  std::string text;
  for (int i = 0; i < 300; ++i) text += "# line " + std::to_string(i) + "\n";
  require_scan(text + "y;x;z\n-2;1,5;3\n5,25;4;-6\n");
}

TEST_CASE("UTF-16 and line ends of the old Macintosh are read") {
  require_scan(in_utf16("x y z\r\n1.5 -2 3\r\n4 5.25 -6\r\n", false));
  require_scan(in_utf16("1.5 -2 3\n4 5.25 -6\n", true));
  require_scan("1.5 -2 3\r4 5.25 -6\r");
  require_scan("x,y,z\r1.5,-2,3\r4,5.25,-6");
}

TEST_CASE("what is not known to be a coordinate is refused with the header, never guessed") {
  for (const std::string header : {"id,time,range", "a b c", "intensity;return;range",
                                   "azimuth,elevation_angle,distance", "x,y,intensity"}) {
    const char separator = header[header.find_first_of(",; ")];
    const std::string row = std::string("1") + separator + "2" + separator + "3\n";
    require_refused(header + "\n" + row, "'" + header + "'");
  }
  std::string counted;
  for (int i = 1; i <= 12; ++i) counted += std::to_string(i) + " 5.5 " + std::to_string(3 * i) + ".25 1\n";
  require_refused(counted, "its first column counts the rows");
  require_refused("v 1 2 3\nv 4 5 6\n", "is an OBJ file");
}

TEST_CASE("a PTX file is read without its empty returns, and several scans are refused") {
  const std::string header = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n9 9 9 1\n";
  require_scan(header + "1.5 -2 3 0.5\n0 0 0 0.5\n0 0 0 0.5\n4 5.25 -6 0.5\n");
  const std::string scan = header + "1 2 3 0\n1 2 3 0\n1 2 3 0\n1 2 3 0\n";
  require_refused(scan + scan, "holds 2 scans");
  require_refused(header + "1 2 3 0\n1 2 3 0\n", "ends before");
}

TEST_CASE("stem tables with tabs, words and row names keep their columns") {
  require_map("id\tspecies\tx\ty\tdbh\n1\tPicea abies\t1.5\t-2\t0.3\n2\t\t4\t5.25\t0.2\n");
  require_map("note\tx\ty\tspecies\n\t1.5\t-2\tPicea abies\n\t4\t5.25\t\n");
  require_map("\"x\" \"y\"\n\"1\" 1.5 -2\n\"2\" 4 5.25\n");
  require_map("x,y\n1,1.5,-2\n2,4,5.25\n");
  require_map("treeID,gx,gy,dbh\n1,1.5,-2,120\n2,4,5.25,240\n");
  require_map("# plot 7\n\n//X,Y,dbh\n1.5,-2,0.3\n4,5.25,0.3\n");
  require_map(
      "x,y,z,radius,parent_id,\n1.5,-2,0,0.1,-1, 1.5,-2,2,0.1,0,\n4,5.25,0,0.1,-1, 4,5.25,2,0.1,0,\n");
  require_map("x,y,dbh,,\n1.5,-2,0.3,,\n4,5.25,0.3,,\n,,,,\n");
}

TEST_CASE("the small inputs that people have are read as what they are") {
  if (!std::filesystem::is_directory(cases())) {
    WARN("skipped: the folder of cases does not exist: " << cases());
    return;
  }
  for (const char* folder :
       {"text_header_not_understood", "text_scans_refused", "ply_refused", "pcd_refused"}) {
    const points expected = read_scan(cases() / folder / "base.txt");
    REQUIRE(expected.size() == 300);
    for (const auto& entry : std::filesystem::directory_iterator(cases() / folder)) {
      const std::string name = entry.path().filename().string();
      if (name == "README" || name == "I.txt" || name == "X.txt" || name == "Z.txt") continue;
      INFO(entry.path());
      const points read = read_scan(entry.path());
      REQUIRE(read.size() == expected.size());
      double worst = 0;
      for (std::size_t i = 0; i < read.size(); ++i) worst = std::max(worst, (read[i] - expected[i]).norm());
      CHECK(worst < 1e-5);
    }
  }
  for (const char* folder : {"stem_csv_refused", "stem_csv_tabs", "stem_csv_units_of_dbh"})
    for (const auto& entry : std::filesystem::directory_iterator(cases() / folder)) {
      if (entry.path().extension() != ".csv") continue;
      INFO(entry.path());
      const stem_table table = read_stems(entry.path());
      REQUIRE(table.stems.size() == 60);
      if (!table.has_radii) continue;
      CHECK(table.stems[1].radius > 0.05);
      CHECK(table.stems[1].radius < 0.5);
    }
}

}  // namespace globalmatch::support::test_tables
