import pytest

from jaxphys.guidance.prompts.subject import subject


@pytest.mark.parametrize(
    ("prompt", "phrase", "nouns"),
    [
        ("a red rose", "red rose", "rose"),
        ("a vase with flowers", "vase", "vase"),
        ("a slice of cake", "cake", "cake"),
        ("a pair of red boots", "red boots", "boots"),
        ("two pancakes", "two pancakes", "pancakes"),
        ("a statue of a lion", "statue of lion", "statue lion"),
        ("a cup and saucer", "cup and saucer", "cup saucer"),
        ("a cat wearing a hat", "cat", "cat"),
        ("a boat sailing on the sea", "boat", "boat"),
        ("an old sailing ship that has three masts", "old sailing ship", "ship"),
        ("a weathered bench covered with moss", "weathered bench", "bench"),
        ("an oil painting", "oil painting", "painting"),
        ("a grandfather clock made of dark wood", "grandfather clock", "clock"),
        ("there is a fox, and the fox is wearing a scarf", "fox", "fox"),
        ("my favourite windmill, the one we saw", "windmill", "windmill"),
        ("please make me a 3d model of a mushroom house for gnomes", "mushroom house", "house"),
        ("I would really like to see a small teapot that whistles", "small teapot", "teapot"),
        ("vanilla ice-cream in a cone", "vanilla ice-cream", "ice-cream"),
        ("a chair on a beach at sunset", "chair", "chair"),
        ("TEAPOT", "TEAPOT", "teapot"),
    ],
)
def test_the_object_of_a_prompt(prompt, phrase, nouns):
    assert subject(prompt) == (phrase, tuple(nouns.split()))


@pytest.mark.parametrize(
    "prompt", ["something sweet", "a thing", "I want to see it", "a picture", "!"]
)
def test_prompts_that_name_nothing(prompt):
    assert subject(prompt) == ("", ())


def test_surroundings_alone_are_the_object():
    assert subject("a table").nouns == ("table",)
