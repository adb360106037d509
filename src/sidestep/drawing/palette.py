"""The colours of Okabe and Ito (2008), told apart with every kind of colour vision."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
FURNITURE = "#EBC4A4"  # a pale vermillion, of obstacles that are large
SERIES = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, BLACK)  # of lines side by side; yellow is too pale
